"""The published training in plain NumPy: equations (9) to (20), Adam, the three transfer steps.

Written to be compared with romc, so it uses the same batches, the same schedule and the same losses. Quantities that are
constant in a step are computed once (latent states in step two, the library in step three).
"""

import numpy as np

WEIGHT_DDZ, WEIGHT_DDX, WEIGHT_L1 = 1e-4, 1e-6, 1e-6
EPOCHS, REFINEMENT, THRESHOLD, THRESHOLD_EVERY = 501, 101, 0.01, 100
LEARNING_RATE = 1e-3


class Adam:
    """Adam with TensorFlow's constants, over one array."""

    def __init__(self, shape):
        self.mean, self.square, self.steps = np.zeros(shape), np.zeros(shape), 0

    def step(self, values, gradient):
        """Moves `values` in place."""
        self.steps += 1
        self.mean += 0.1 * (gradient - self.mean)
        self.square += 0.001 * (gradient * gradient - self.square)
        correction = np.sqrt(1 - 0.999**self.steps)
        rate = LEARNING_RATE * correction / (1 - 0.9**self.steps)
        values -= rate * self.mean / (np.sqrt(self.square) + 1e-7 * correction)


def library(z, dz, u_lat):
    """1; z; dz; sin z; sin dz; cos z; cos dz; u_lat: the author's order, rows are samples."""
    one = np.ones((len(z), 1))
    return np.hstack([one, z, dz, np.sin(z), np.sin(dz), np.cos(z), np.cos(dz), u_lat])


def latent_input(encoder, u):
    """u_lat = pinv(W_e^T) u, with the inverse Gram matrix for the gradient."""
    inverse = np.linalg.inv(encoder.T @ encoder)
    projection = encoder @ inverse
    return u @ projection, projection, inverse


def joint_gradient(parameters, batch, weight_l1):
    """Losses and gradient of step one on one batch."""
    encoder, encoder_bias, decoder, decoder_bias, xi = parameters
    x, dx, ddx, u = batch
    n, state_dim = x.shape
    d = encoder.shape[1]
    z, dz, ddz = x @ encoder + encoder_bias, dx @ encoder, ddx @ encoder
    u_lat, projection, inverse = latent_input(encoder, u)
    theta = library(z, dz, u_lat)
    predicted = theta @ xi

    miss = z @ decoder + decoder_bias - x
    latent_miss = predicted - ddz
    real_miss = predicted @ decoder - ddx
    losses = (
        (miss**2).mean(),
        (latent_miss**2).mean(),
        (real_miss**2).mean(),
        np.abs(xi).mean(),
    )

    miss *= 2 / (n * state_dim)
    latent_pull = 2 * WEIGHT_DDZ / (n * d) * latent_miss
    real_pull = 2 * WEIGHT_DDX / (n * state_dim) * real_miss
    pull = latent_pull + real_pull @ decoder.T
    g_decoder = z.T @ miss + predicted.T @ real_pull
    g_xi = theta.T @ pull + weight_l1 / xi.size * np.sign(xi)

    g_theta = pull @ xi.T
    blocks = [g_theta[:, 1 + i * d : 1 + (i + 1) * d] for i in range(7)]
    g_z = miss @ decoder.T + blocks[0] + blocks[2] * np.cos(z) - blocks[4] * np.sin(z)
    g_dz = blocks[1] + blocks[3] * np.cos(dz) - blocks[5] * np.sin(dz)
    k = u.T @ blocks[6] @ inverse
    crossed = projection.T @ k
    g_encoder = x.T @ g_z + dx.T @ g_dz - ddx.T @ latent_pull + k - encoder @ (crossed + crossed.T)
    return losses, (g_encoder, g_z.sum(0), g_decoder, miss.sum(0), g_xi)


def start(state_dim, d, rng):
    """Glorot-uniform maps, Xi at ones."""
    bound = np.sqrt(6 / (state_dim + d))
    return [
        rng.uniform(-bound, bound, (state_dim, d)),
        np.zeros(d),
        rng.uniform(-bound, bound, (d, state_dim)),
        np.zeros(state_dim),
        np.ones((7 * d + 1, d)),
    ]


def thresholds_at(epoch):
    """Whether coefficients are masked before this epoch."""
    return 0 < epoch < EPOCHS and epoch % THRESHOLD_EVERY == 0


def step_one(parameters, batches):
    """Encoder, decoder and Xi together."""
    optimisers = [Adam(block.shape) for block in parameters]
    support = np.ones_like(parameters[4])
    for epoch in range(EPOCHS + REFINEMENT):
        if thresholds_at(epoch):
            support *= np.abs(parameters[4]) >= THRESHOLD
            parameters[4] *= support
        for batch in batches:
            _, gradient = joint_gradient(parameters, batch, WEIGHT_L1 if epoch < EPOCHS else 0.0)
            for optimiser, block, g in zip(optimisers, parameters, gradient):
                optimiser.step(block, g)
            parameters[4] *= support


def step_two(parameters, batches):
    """The decoder alone."""
    encoder, encoder_bias, decoder, decoder_bias, _ = parameters
    pairs = [(x @ encoder + encoder_bias, x) for x, _, _, _ in batches]
    first, second = Adam(decoder.shape), Adam(decoder_bias.shape)
    for _ in range(EPOCHS + REFINEMENT):
        for z, x in pairs:
            miss = (z @ decoder + decoder_bias - x) * (2 / x.size)
            first.step(decoder, z.T @ miss)
            second.step(decoder_bias, miss.sum(0))


def step_three(parameters, batches):
    """Xi of one phase."""
    encoder, encoder_bias, decoder, _, _ = parameters
    samples = []
    for x, dx, ddx, u in batches:
        u_lat, _, _ = latent_input(encoder, u)
        theta = library(x @ encoder + encoder_bias, dx @ encoder, u_lat)
        samples.append((theta, ddx @ encoder, ddx))
    xi = np.ones((7 * encoder.shape[1] + 1, encoder.shape[1]))
    optimiser, support = Adam(xi.shape), np.ones_like(xi)
    for epoch in range(EPOCHS + REFINEMENT):
        if thresholds_at(epoch):
            support *= np.abs(xi) >= THRESHOLD
            xi *= support
        weight_l1 = WEIGHT_L1 if epoch < EPOCHS else 0.0
        for theta, ddz, ddx in samples:
            predicted = theta @ xi
            pull = 2 * WEIGHT_DDZ / ddz.size * (predicted - ddz)
            pull += 2 * WEIGHT_DDX / ddx.size * (predicted @ decoder - ddx) @ decoder.T
            optimiser.step(xi, theta.T @ pull + weight_l1 / xi.size * np.sign(xi))
            xi *= support
    return xi
