//! Words of the generated documentation for the maps of a model.

/// What the first argument of the encoder's and the decoder's functions is, if they take one.
pub(super) fn points([encoder, decoder]: [bool; 2]) -> [&'static str; 2] {
    let x = "x: robot coordinates at which the Jacobian is taken, SI units. ";
    let z = "z: latent coordinates at which the Jacobian is taken (scaled). ";
    [if encoder { x } else { "" }, if decoder { z } else { "" }]
}

/// The equations of `encode`, `encode_velocity`, `decode`, `decode_velocity`, `project_input` and
/// `lift_input`, for an encoder and a decoder that are nonlinear or not.
pub(super) fn titles(is_nonlinear: [bool; 2]) -> [&'static str; 6] {
    let [encoder, decoder] = is_nonlinear.map(usize::from);
    [
        [
            "Latent coordinates: z = W_e (s_x x) + b_e.",
            "Latent coordinates: z = E(s_x x) with the nonlinear encoder E.",
        ][encoder],
        [
            "Latent velocities: dz = W_e (s_x dx); velocities take no bias.",
            "Latent velocities: dz = J (s_x dx) with J, the encoder's Jacobian at s_x x.",
        ][encoder],
        [
            "Robot coordinates: x = (W_d z + b_d) / s_x.",
            "Robot coordinates: x = D(z) / s_x with the nonlinear decoder D.",
        ][decoder],
        [
            "Robot velocities: dx = (W_d dz) / s_x; velocities take no bias.",
            "Robot velocities: dx = (J dz) / s_x with J, the decoder's Jacobian at z.",
        ][decoder],
        [
            "Latent inputs: u_lat = pinv(W_e^T) (s_u u).",
            "Latent inputs: u_lat = pinv(J^T) (s_u u) with J, the encoder's Jacobian at s_x x, \
             by the normal equations; not finite where J has not full row rank.",
        ][encoder],
        [
            "Generalised inputs: u = (W_e^T u_lat) / s_u.",
            "Generalised inputs: u = (J^T u_lat) / s_u with J, the encoder's Jacobian at s_x x.",
        ][encoder],
    ]
}

/// An equation of the maps between physical values, the scale factors folded into the matrices.
pub(super) fn in_matrices(title: &str) -> String {
    without_factors(title)
        .replace("pinv(W_e^T) u", "P u")
        .replace("W_e^T u_lat", "L u_lat")
}

/// An equation of the maps between scaled values.
pub(super) fn without_factors(title: &str) -> String {
    [
        ("(s_x x)", "x"),
        ("(s_x dx)", "dx"),
        ("(s_u u)", "u"),
        ("s_x x", "x"),
        (" / s_x", ""),
        (" / s_u", ""),
    ]
    .into_iter()
    .fold(title.to_owned(), |text, (from, to)| text.replace(from, to))
}
