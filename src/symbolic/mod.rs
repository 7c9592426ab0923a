//! The computer algebra system: hash-consed expressions and what can be asked of them.
