//! Of `src/codegen/codegen/ident.rs`.

use super::*;

#[test]
fn namer_avoids_keywords_and_repetition() {
    let mut namer = Namer::new("double");
    let names = ["double", "t", "t", "t", "x; system(1)", "1a"].map(|n| namer.mint(n).0);
    assert_eq!(names, ["double2", "t", "t2", "t3", "x__system_1_", "v1a"]);
}
