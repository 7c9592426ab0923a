//! From programs and equations to text: C, Rust, LaTeX.
