//! Words of the generated documentation for the maps of a model.

/// The equations of the maps in words of the documentation, for linear and nonlinear models.
pub(super) struct MapEquations {
    pub curved_encoder: bool,
    pub curved_decoder: bool,
}

impl MapEquations {
    /// What the first argument of the encoder's and the decoder's functions is, if they take one.
    pub fn points(&self) -> (&'static str, &'static str) {
        let x = "x: robot coordinates at which the Jacobian is taken, SI units. ";
        let z = "z: latent coordinates at which the Jacobian is taken (scaled). ";
        (
            if self.curved_encoder { x } else { "" },
            if self.curved_decoder { z } else { "" },
        )
    }

    pub fn encode(&self) -> &'static str {
        match self.curved_encoder {
            false => "Latent coordinates: z = W_e (s_x x) + b_e.",
            true => "Latent coordinates: z = E(s_x x) with the nonlinear encoder E.",
        }
    }

    pub fn encode_velocity(&self) -> &'static str {
        match self.curved_encoder {
            false => "Latent velocities: dz = W_e (s_x dx); velocities take no bias.",
            true => "Latent velocities: dz = J (s_x dx) with J, the encoder's Jacobian at s_x x.",
        }
    }

    pub fn decode(&self) -> &'static str {
        match self.curved_decoder {
            false => "Robot coordinates: x = (W_d z + b_d) / s_x.",
            true => "Robot coordinates: x = D(z) / s_x with the nonlinear decoder D.",
        }
    }

    pub fn decode_velocity(&self) -> &'static str {
        match self.curved_decoder {
            false => "Robot velocities: dx = (W_d dz) / s_x; velocities take no bias.",
            true => "Robot velocities: dx = (J dz) / s_x with J, the decoder's Jacobian at z.",
        }
    }

    pub fn project_input(&self) -> &'static str {
        match self.curved_encoder {
            false => "Latent inputs: u_lat = pinv(W_e^T) (s_u u).",
            true => {
                "Latent inputs: u_lat = pinv(J^T) (s_u u) with J, the encoder's Jacobian at s_x x, \
                 by the normal equations; not finite where J has not full row rank."
            }
        }
    }

    pub fn lift_input(&self) -> &'static str {
        match self.curved_encoder {
            false => "Generalised inputs: u = (W_e^T u_lat) / s_u.",
            true => {
                "Generalised inputs: u = (J^T u_lat) / s_u with J, the encoder's Jacobian at s_x x."
            }
        }
    }
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
