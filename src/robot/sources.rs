//! The text of these sources: every generated controller holds them as its module `robot`.

macro_rules! sources {
    ($($file:ident)*) => {
        &[$((concat!(stringify!($file), ".rs"), include_str!(concat!(stringify!($file), ".rs")))),*]
    };
}

/// File name and text; `lib.rs` declares this module last, and what stands from there on is not for generated crates.
pub const SOURCES: &[(&str, &str)] = sources! {
    error geometry input_rule joints leg lib wrench
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sources_are_all_files_but_those_declared_last() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut found: Vec<String> = std::fs::read_dir(root)
            .expect("a folder of sources")
            .map(|entry| entry.expect("an entry").file_name())
            .map(|name| name.to_string_lossy().into_owned())
            .filter(|name| {
                name.ends_with(".rs") && !["sources.rs", "serialised.rs"].contains(&name.as_str())
            })
            .collect();
        found.sort();
        assert!(SOURCES.iter().map(|(name, _)| *name).eq(found));
    }
}
