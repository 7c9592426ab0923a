//! The text of these sources: every generated controller holds them as its module `robot`.

macro_rules! sources {
    ($($file:ident)*) => {
        &[$((concat!(stringify!($file), ".rs"), include_str!(concat!(stringify!($file), ".rs")))),*]
    };
}

/// File name and text. `lib.rs` declares this module last; generated crates omit the text from that line on.
pub const SOURCES: &[(&str, &str)] = sources! {
    error geometry input_rule joints leg lib links wrench
};
