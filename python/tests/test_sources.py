"""Models of other libraries' objects."""

import numpy as np
import pytest
import romc

LIBRARY = romc.Library(degree=1, inputs=True)


class Module:
    """What romc asks of torch.nn.Module: children, parameters and a state dictionary."""

    def __init__(self, **parts):
        self.parts = parts

    def named_children(self):
        return [(name, part) for name, part in self.parts.items() if isinstance(part, Module)]

    def named_modules(self, prefix=""):
        yield prefix, self
        for name, child in self.named_children():
            yield from child.named_modules(f"{prefix}.{name}" if prefix else name)

    def state_dict(self, keep_vars=False):
        assert keep_vars
        state = {}
        for name, part in self.parts.items():
            if isinstance(part, Module):
                state.update({f"{name}.{inner}": value for inner, value in part.state_dict(True).items()})
            elif part is not None:
                state[name] = part
        return state


class Linear(Module):
    def __init__(self, inputs, outputs, seed, bias=True):
        rng = np.random.default_rng(seed)
        self.weight = rng.normal(size=(outputs, inputs))
        self.bias = rng.normal(size=outputs) if bias else None
        super().__init__(weight=self.weight, bias=self.bias)


class ELU(Module):
    alpha = 1.0


class Tanh(Module):
    pass


class Dropout(Module):
    pass


class BatchNorm1d(Module):
    pass


def Sequential(*layers):
    return Module(**{str(index): layer for index, layer in enumerate(layers)})


def autoencoder(activation=ELU, middle=None):
    encoder = Sequential(Linear(18, 9, 1), activation(), *(middle or []), Linear(9, 3, 2))
    return Module(encoder=encoder, decoder=Linear(3, 18, 3), xi_contact=np.ones((10, 3)))


def test_module_is_an_encoder_with_its_activation():
    module = autoencoder(middle=[Dropout()])
    model = romc.Model.from_torch(Module(net=module, offset=np.zeros(3)), library=LIBRARY, robot="go1")
    first, last = module.parts["encoder"].parts["0"], module.parts["encoder"].parts["3"]
    x = np.random.default_rng(0).normal(size=(5, 18))
    hidden = x @ first.weight.T + first.bias
    hidden = np.where(hidden > 0, hidden, np.expm1(hidden))
    np.testing.assert_allclose(model.encode(x), hidden @ last.weight.T + last.bias, rtol=1e-12, atol=1e-12)
    assert np.array_equal(model.xi["contact"], np.ones((10, 3)))


def test_two_modules_and_xi_apart():
    encoder, decoder = Linear(18, 3, 1), Linear(3, 18, 3, bias=False)
    xi = {"contact": np.ones((10, 3)), "flight": np.zeros((10, 3))}
    model = romc.Model.from_torch(encoder, decoder, xi=xi, library=LIBRARY, robot="go1", scaling=0.1)
    x = np.random.default_rng(0).normal(size=18)
    np.testing.assert_allclose(model.encode(x), encoder.weight @ (0.1 * x) + encoder.bias, rtol=1e-12)
    assert list(model.phases) == ["contact", "flight"]


def test_tensor_of_another_name_is_mapped():
    module = autoencoder()
    module.parts["Xi_c"] = module.parts.pop("xi_contact")
    model = romc.Model.from_torch(module, library=LIBRARY, map={"xi.contact": "Xi_c"}, robot="go1")
    assert list(model.phases) == ["contact"]


@pytest.mark.parametrize(
    "module, tensor, found",
    [
        (lambda: autoencoder(BatchNorm1d), "encoder.1", "a layer BatchNorm1d"),
        (lambda: autoencoder(middle=[Tanh()]), "encoder.2", "a layer Tanh"),
        (lambda: autoencoder(middle=[Linear(9, 9, 5), Tanh()]), "encoder", "elu .* tanh"),
        (lambda: Module(encoder=Sequential(Linear(18, 3, 1), Tanh()), decoder=Linear(3, 18, 3)), "encoder.1", "tanh"),
        (lambda: Module(encoder=Sequential(Linear(18, 9, 1), Linear(9, 3, 2)), decoder=Linear(3, 18, 3)),
         "encoder.1", "two linear layers"),
        (lambda: Module(body=Linear(18, 3, 1)), "encoder", "parts body"),
        (lambda: Module(encoder=Dropout(), decoder=Linear(3, 18, 3)), "encoder", "no Linear"),
    ],
)
def test_module_of_another_form_is_refused_with_its_layer(module, tensor, found):
    with pytest.raises(romc.ModelError, match=found) as caught:
        romc.Model.from_torch(module(), library=LIBRARY, robot="go1", xi={"contact": np.ones((10, 3))})
    assert caught.value.tensor == tensor


def test_settings_of_an_activation_count():
    module = autoencoder()
    module.parts["encoder"].parts["1"].alpha = 0.5
    with pytest.raises(romc.ModelError, match="alpha=0.5"):
        romc.Model.from_torch(module, library=LIBRARY, robot="go1")


@pytest.mark.parametrize("activation", ["ELU", "Tanh", "Sigmoid", "ReLU", "GELU", "SiLU", "Softplus"])
def test_torch_module_and_its_own_prediction(activation):
    torch = pytest.importorskip("torch")
    nn = torch.nn
    torch.manual_seed(3)

    class Autoencoder(nn.Module):
        def __init__(self):
            super().__init__()
            act = getattr(nn, activation)
            self.encoder = nn.Sequential(nn.Linear(18, 12), act(), nn.Dropout(0.1), nn.Linear(12, 3))
            self.decoder = nn.Sequential(nn.Linear(3, 12), act(), nn.Linear(12, 18))
            self.xi = nn.ParameterDict({name: nn.Parameter(torch.randn(10, 3)) for name in ("contact", "flight")})

    module = Autoencoder().double().eval()
    model = romc.Model.from_torch(module, library=LIBRARY, robot="go1")
    x = torch.randn(6, 18, dtype=torch.float64)
    z = module.encoder(x)
    np.testing.assert_allclose(model.encode(x), z.detach().numpy(), rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(model.decode(z), module.decoder(z).detach().numpy(), rtol=1e-11, atol=1e-12)
    assert np.array_equal(model.xi["flight"], module.xi["flight"].detach().double().numpy())


class TestPySINDy:
    """Fitted models predict what romc computes."""

    @pytest.fixture(scope="class")
    def ps(self):
        return pytest.importorskip("pysindy")

    def samples(self, seed):
        rng = np.random.default_rng(seed)
        return rng.normal(size=(400, 4)), rng.normal(size=(400, 2))

    def fitted(self, ps, library, only_accelerations):
        x, u = self.samples(1)
        first = 0.36 - 0.91 * x[:, 3] - 0.75 * np.sin(x[:, 2]) + 0.11 * u[:, 0]
        second = -0.16 + 0.3 * x[:, 0] * x[:, 3] - 0.5 * np.cos(2 * x[:, 1]) + 0.14 * u[:, 1]
        ddz = np.stack([first, second], axis=1)
        model = ps.SINDy(feature_library=library, optimizer=ps.STLSQ(threshold=0.01))
        target = ddz if only_accelerations else np.hstack([x[:, 2:], ddz])
        return model.fit(x, t=0.002, x_dot=target, u=u)

    def check(self, model, phase, fitted):
        x, u = self.samples(2)
        expected = fitted.predict(x, u=u)[:, -2:]
        found = model.acceleration(phase, x[:, :2], x[:, 2:], u)
        np.testing.assert_allclose(found, expected, rtol=1e-11, atol=1e-11)

    def test_phases_with_libraries_of_their_own(self, ps):
        models = {
            "contact": self.fitted(ps, ps.PolynomialLibrary(degree=2) + ps.FourierLibrary(n_frequencies=2), False),
            "flight": self.fitted(ps, ps.PolynomialLibrary(degree=3), True),
        }
        model = romc.Model.from_pysindy(models)
        assert list(model.phases) == ["contact", "flight"]
        for phase, fitted in models.items():
            self.check(model, phase, fitted)

    def test_single_model_always_holds(self, ps):
        fitted = self.fitted(ps, ps.PolynomialLibrary(degree=2), False)
        model = romc.Model.from_pysindy(fitted, name="hopper")
        assert list(model.phases) == ["always"]
        self.check(model, "always", fitted)

    def test_models_that_do_not_fit_are_refused(self, ps):
        x = np.random.default_rng(1).normal(size=(100, 3))
        odd = ps.SINDy(feature_library=ps.PolynomialLibrary(degree=1)).fit(x, t=0.01, x_dot=x)
        with pytest.raises(romc.ModelError, match="3 states") as caught:
            romc.Model.from_pysindy({"contact": odd})
        assert caught.value.tensor == "xi.contact"
