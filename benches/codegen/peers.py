"""Emits one model through one peer: peers.py PEER MODEL.json OUT; run in the peer's environment.

Every peer gets sum(coefficient * term) for each acceleration, its own derivatives and its own
common subexpressions, and returns C (or Rust) for `NAME(z, dz, u, ddz)` and `NAME_jac(z, dz, u, ddz, jac)`
with the structural nonzeros of the Jacobian row by row.
"""

import json
import sys
from pathlib import Path

from models import terms

HEAD = "#include <math.h>\n"
SIGNATURE = "const double *z, const double *dz, const double *u, double *ddz"


def accelerations(model, symbols, sin, cos):
    """The right-hand sides; inactive terms are left out."""
    scope = {"sin": sin, "cos": cos, **symbols}
    library = [eval(name, {"__builtins__": {}}, scope) for name in terms(model["d"], model["poly_order"])]
    result = []
    for row in range(model["d"]):
        total = 0
        for coefficients, term in zip(model["xi"], library):
            if coefficients[row] != 0.0:
                total = total + coefficients[row] * term
        result.append(total)
    return result


def names(d):
    return [f"{kind}{i + 1}" for kind in ("z", "dz", "u") for i in range(d)]


def loads(d, number="double"):
    lines = []
    for kind in ("z", "dz", "u"):
        lines += [f"const {number} {kind}{i + 1} = {kind}[{i}]; (void){kind}{i + 1};" for i in range(d)]
    return "\n".join(lines)


def c_function(name, d, temporaries, outputs):
    body = [f"const double {symbol} = {code};" for symbol, code in temporaries]
    body += [f"{target} = {code};" for target, code in outputs]
    jacobian = ", double *jac" if name.endswith("_jac") else ""
    return f"void {name}({SIGNATURE}{jacobian}) {{\n{loads(d)}\n" + "\n".join(body) + "\n}\n"


def with_cse(name, model, symbols, functions, cse, code, diff):
    """C of a library with `cse` and a printer."""
    d = model["d"]
    ddz = accelerations(model, symbols, *functions)
    jacobian = [diff(a, symbols[v]) for a in ddz for v in names(d)]
    jacobian = [entry for entry in jacobian if entry != 0]
    text = HEAD
    for suffix, expressions in (("", ddz), ("_jac", ddz + jacobian)):
        replaced, reduced = cse(expressions)
        temporaries = [(str(symbol), code(value)) for symbol, value in replaced]
        targets = [f"ddz[{i}]" for i in range(d)] + [f"jac[{i}]" for i in range(len(jacobian))]
        outputs = [(target, code(value)) for target, value in zip(targets, reduced)]
        text += c_function(name + suffix, d, temporaries, outputs)
    return {f"{name}.c": text}


def sympy_code(name, model):
    import sympy

    symbols = {v: sympy.Symbol(v, real=True) for v in names(model["d"])}
    return with_cse(name, model, symbols, (sympy.sin, sympy.cos), sympy.cse, sympy.ccode, sympy.diff)


def symengine_code(name, model):
    import symengine

    symbols = {v: symengine.Symbol(v) for v in names(model["d"])}
    functions = (symengine.sin, symengine.cos)
    return with_cse(
        name, model, symbols, functions, symengine.cse, symengine.ccode, lambda a, v: symengine.sympify(a).diff(v)
    )


def symforce_code(name, model, rust):
    import symforce

    symforce.set_epsilon_to_number(0.0)
    import symforce.symbolic as sf
    from symforce import codegen
    from symforce.codegen import codegen_util
    from symforce.codegen.backends.rust.rust_config import RustConfig
    from symforce.values import Values

    d = model["d"]
    symbols = {v: sf.Symbol(v) for v in names(d)}
    ddz = [sf.S(a) for a in accelerations(model, symbols, sf.sin, sf.cos)]
    jacobian = [a.diff(symbols[v]) for a in ddz for v in names(d)]
    jacobian = [entry for entry in jacobian if entry != 0]
    text = "" if rust else "#include <cmath>\nusing Scalar = double;\n"
    config = RustConfig() if rust else codegen.CppConfig()
    for suffix, expressions in (("", ddz), ("_jac", ddz + jacobian)):
        inputs = Values(**symbols)
        targets = [f"ddz[{i}]" for i in range(d)] + [f"jac[{i}]" for i in range(len(jacobian))]
        outputs = Values(**{f"o{i}": e for i, e in enumerate(expressions)})
        printed = codegen_util.print_code(inputs=inputs, outputs=outputs, sparse_mat_data={}, config=config)
        temporaries = [(str(t[0]), t[1]) for t in printed.intermediate_terms]
        values = [code for term in printed.dense_terms for _, code in term[2]]
        clean = lambda code: code.replace("Scalar(", "(double)(")
        if rust:
            jac = ", jac: *mut f64" if suffix else ""
            text += f"#[no_mangle]\npub unsafe extern \"C\" fn {name}{suffix}(z: *const f64, dz: *const f64, u: *const f64, ddz: *mut f64{jac}) {{\n"
            for kind in ("z", "dz", "u"):
                text += "".join(f"let {kind}{i + 1} = *{kind}.add({i});\n" for i in range(d))
            text += "".join(f"let {symbol} = {code};\n" for symbol, code in temporaries)
            for target, code in zip(targets, values):
                array, index = target[:-1].split("[")
                text += f"*{array}.add({index}) = {code};\n"
            text += "}\n"
        else:
            temporaries = [(symbol, clean(code)) for symbol, code in temporaries]
            text += 'extern "C" '
            text += c_function(name + suffix, d, temporaries, [(t, clean(c)) for t, c in zip(targets, values)])
    return {f"{name}.rs" if rust else f"{name}.cpp": text}


def casadi_code(name, model):
    import casadi

    d = model["d"]
    z, dz, u = (casadi.SX.sym(kind, d) for kind in ("z", "dz", "u"))
    symbols = {f"{kind}{i + 1}": v[i] for kind, v in (("z", z), ("dz", dz), ("u", u)) for i in range(d)}
    ddz = casadi.vertcat(*accelerations(model, symbols, casadi.sin, casadi.cos))
    jacobian = casadi.jacobian(ddz, casadi.vertcat(z, dz, u))
    # CasADi stores columns; the transpose's nonzeros are the rows'.
    rows = casadi.cse([ddz, jacobian.T])
    text = ""
    for suffix, outputs in (("", [casadi.cse(ddz)]), ("_jac", rows)):
        function = casadi.Function(f"sx{suffix}_function", [z, dz, u], outputs)
        generator = casadi.CodeGenerator(f"{name}{suffix}_gen.c")
        generator.add(function)
        body = generator.dump().replace("casadi_", f"{name}{suffix}_casadi_")
        text += body.replace("CASADI_", f"CASADI{suffix.upper()}_") if suffix else body
        jac = ", double *jac" if suffix else ""
        pointers = "ddz, jac" if suffix else "ddz"
        text += f"""
void {name}{suffix}({SIGNATURE}{jac}) {{
const double *arg[3] = {{z, dz, u}};
double *res[2] = {{{pointers}}};
{function.name()}(arg, res, 0, 0, 0);
}}
"""
    return {f"{name}.c": text}


PEERS = {
    "casadi": casadi_code,
    "sympy": sympy_code,
    "symengine": symengine_code,
    "symforce": lambda name, model: symforce_code(name, model, rust=False),
    "symforce_rust": lambda name, model: symforce_code(name, model, rust=True),
}

if __name__ == "__main__":
    peer, model, out = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    for file, text in PEERS[peer](f"{peer}_{model.stem}", json.loads(model.read_text())).items():
        (out / file).write_text(text)
