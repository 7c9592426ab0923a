//! Of `src/learn/train/body.rs`.

use super::*;

#[test]
fn rows_of_the_body_have_one_order_whatever_that_of_the_list() {
    let rows: BodyRows = "yaw,pitch,z,x".parse().expect("known rows");
    assert_eq!(rows.to_string(), "x,z,pitch,yaw");
    assert_eq!(rows.coordinates, [12, 14, 16, 17]);
    let all: BodyRows = "all".parse().expect("known rows");
    assert_eq!(all.coordinates, [12, 14, 16, 13, 15, 17]);
    assert_eq!("x,y,z,roll,pitch,yaw".parse(), Ok(all.clone()));
    assert_eq!(all.to_string(), "all");
    let spatial = |text: &str| text.parse::<BodyRows>().expect("known rows").is_spatial();
    assert_eq!(["x,z,pitch", "x,y,z"].map(spatial), [false, true]);
}

#[test]
fn rows_without_the_centre_of_mass_or_of_unknown_names_are_refused() {
    for text in ["", "z,pitch", "x,pitch", "x,z,z", "x,z,hop", "all,x"] {
        let refused = text.parse::<BodyRows>().expect_err(text);
        assert!(refused.starts_with(&format!(
            "found `{text}`, expected `all` or a list with x and z"
        )));
    }
}
