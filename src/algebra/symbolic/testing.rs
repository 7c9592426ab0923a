//! Expressions of tests, in and out as text.

use super::{ExprId, ExprPool};

impl ExprPool {
    /// The expression of a text that parses.
    pub(crate) fn parsed(&mut self, text: &str) -> ExprId {
        self.parse(text, &|_| true)
            .unwrap_or_else(|error| panic!("{text}: {error}"))
    }
}

/// The text of what `rewrite` makes of the expression of a text.
pub(super) fn rewritten(
    text: &str,
    rewrite: impl FnOnce(&mut ExprPool, ExprId) -> ExprId,
) -> String {
    let mut pool = ExprPool::new();
    let expr = pool.parsed(text);
    let result = rewrite(&mut pool, expr);
    pool.display(result).to_string()
}

/// Asserts that `rewrite` makes the right text of each left one.
pub(super) fn assert_rewritten(
    rewrite: impl Fn(&mut ExprPool, ExprId) -> ExprId,
    cases: &[(&str, &str)],
) {
    for (text, expected) in cases {
        assert_eq!(rewritten(text, &rewrite), *expected, "{text}");
    }
}
