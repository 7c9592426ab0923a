//! The text of these sources: every generated controller holds them.

/// Path and text of files, by their folders.
macro_rules! sources {
    ($($folder:literal: $($file:ident)*;)*) => {
        &[$($((
            concat!($folder, "/", stringify!($file), ".rs"),
            include_str!(concat!($folder, "/", stringify!($file), ".rs")),
        )),*),*]
    };
}

/// Path below this crate, which is that below `src` of a generated one, and text of each file.
pub const SOURCES: &[(&str, &str)] = sources! {
    "online":
        command conic control_model controller dense effectiveness error estimate horizon
        interface lift linearise mod plan problem qp reference settings stage step structured
        trajectory;
    "solver":
        interior links lower mod point problem riccati rows scalar solve;
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_all_files_of_their_folders() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        for folder in ["online", "solver"] {
            let mut found: Vec<String> = std::fs::read_dir(root.join(folder))
                .expect("a folder of sources")
                .map(|entry| entry.expect("an entry").file_name())
                .map(|name| format!("{folder}/{}", name.to_string_lossy()))
                .filter(|path| path.ends_with(".rs"))
                .collect();
            found.sort();
            let listed: Vec<&str> = SOURCES
                .iter()
                .map(|(path, _)| *path)
                .filter(|path| path.rsplit_once('/').map(|(parent, _)| parent) == Some(folder))
                .collect();
            assert_eq!(listed, found);
        }
    }
}
