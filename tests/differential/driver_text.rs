//! Programs that run generated functions on the points of a file.

use super::functions::Function;

/// Where each slot begins in a function's flat record of inputs or outputs.
fn offsets(slots: &[romc::ir::Slot]) -> Vec<(&str, usize, usize)> {
    let mut offset = 0;
    slots
        .iter()
        .map(|slot| {
            let at = offset;
            offset += slot.len;
            (slot.name.as_str(), at, slot.len)
        })
        .collect()
}

/// A program that reads the points of all functions from its first file and writes their results to its second.
/// Functions are called through a table, because a `main` that inlines all of them compiles slowly.
pub fn c_driver(models: &[String], functions: &[Function]) -> String {
    let mut text = String::from("#include <stdio.h>\n#include <stdlib.h>\n#include <string.h>\n");
    for model in models {
        text.push_str(&format!("#include \"{model}/{model}.h\"\n"));
    }
    let mut entries = String::new();
    for (k, function) in functions.iter().enumerate() {
        text.push_str(&match function.is_batch() {
            true => c_batch(k, function),
            false => c_single(k, function),
        });
        let (n, from, to) = calls(function);
        entries.push_str(&format!("    {{run{k}, {n}, {from}, {to}}},\n"));
    }
    let total = |len: fn(&Function) -> usize| -> usize {
        functions.iter().map(|f| f.n_points * len(f)).sum()
    };
    let (from, to) = (total(Function::input_len), total(Function::output_len));
    text.push_str(&format!(
        "static const struct {{
    void (*run)(const double *in, double *out);
    size_t n, from, to;
}} functions[] = {{
{entries}}};
int main(int argc, char **argv) {{
double *inputs = malloc({from} * sizeof *inputs), *outputs = malloc({to} * sizeof *outputs);
if (argc != 3 || !inputs || !outputs) return 2;
const double *in = inputs;
double *out = outputs;
FILE *file = fopen(argv[1], \"rb\");
if (!file || fread(inputs, sizeof *inputs, {from}, file) != {from}) return 3;
fclose(file);
for (size_t k = 0; k < sizeof functions / sizeof *functions; ++k)
    for (size_t p = 0; p < functions[k].n; ++p, in += functions[k].from, out += functions[k].to)
        functions[k].run(in, out);
file = fopen(argv[2], \"wb\");
if (!file || fwrite(outputs, sizeof *outputs, {to}, file) != {to}) return 4;
free(inputs);
free(outputs);
return fclose(file) == 0 ? 0 : 5;
}}\n"
    ));
    text
}

/// How often a driver calls a function, and how many numbers each call reads and writes: a batch reads all points at
/// once.
fn calls(function: &Function) -> (usize, usize, usize) {
    let n = function.n_points;
    let (from, to) = (function.input_len(), function.output_len());
    match function.is_batch() {
        true => (1, n * from, n * to),
        false => (n, from, to),
    }
}

fn c_single(k: usize, function: &Function) -> String {
    let (model, name) = (&function.model, &function.name);
    let mut body = String::new();
    let mut arguments = Vec::new();
    let outputs = offsets(&function.program.outputs);
    for (slot, at, len) in offsets(&function.program.inputs) {
        let in_place = outputs.iter().find(|(name, ..)| *name == slot);
        if let Some((_, to, _)) = in_place {
            body.push_str(&format!(
                "memcpy(out + {to}, in + {at}, {len} * sizeof *in);\n"
            ));
            arguments.push(format!("out + {to}"));
        } else if slot == "h" {
            arguments.push(format!("in[{at}]"));
        } else {
            arguments.push(format!("in + {at}"));
        }
    }
    if !function.is_step() {
        arguments.extend(outputs.iter().map(|(_, at, _)| format!("out + {at}")));
    }
    if name.ends_with("_jacobian") && outputs.len() == 1 {
        arguments.push("out".to_owned());
    }
    let arguments = arguments.join(", ");
    format!(
        "static void run{k}(const double *in, double *out) {{\n{body}{model}_{name}({arguments});\n}}\n"
    )
}

/// All points in one call: point by point in the file, variable by variable in the batch.
fn c_batch(k: usize, function: &Function) -> String {
    let (n, d) = (function.n_points, function.output_len());
    let (model, name) = (&function.model, &function.name);
    format!(
        "static void run{k}(const double *in, double *out) {{
enum {{ N = {n}, D = {d} }};
static double at[3][D * N], ddz[D * N];
for (size_t p = 0; p < N; ++p) for (size_t k = 0; k < 3 * D; ++k) at[k / D][k % D * N + p] = in[p * 3 * D + k];
{model}_{name}(N, at[0], at[1], at[2], ddz);
for (size_t p = 0; p < N; ++p) for (size_t k = 0; k < D; ++k) out[p * D + k] = ddz[k * N + p];
}}\n"
    )
}

fn rust_batch(k: usize, function: &Function) -> String {
    let (n, d) = (function.n_points, function.output_len());
    let (model, name) = (&function.model, &function.name);
    format!(
        "fn run{k}(input: &[f64], out: &mut [f64]) {{
    const N: usize = {n};
    const D: usize = {d};
    let mut at = [[0.0; D * N]; 3];
    let mut ddz = [0.0; D * N];
    for p in 0..N {{ for k in 0..3 * D {{ at[k / D][k % D * N + p] = input[p * 3 * D + k]; }} }}
    {model}::{name}(N, &at[0], &at[1], &at[2], &mut ddz);
    for p in 0..N {{ for k in 0..D {{ out[p * D + k] = ddz[k * N + p]; }} }}
}}\n"
    )
}

/// The same in Rust; each model's crate is a module of the program.
pub fn rust_driver(functions: &[Function]) -> String {
    let mut text = String::from(
        "type Entry = (fn(&[f64], &mut [f64]), usize, usize, usize);
fn array<const N: usize>(values: &[f64]) -> &[f64; N] { values.try_into().unwrap() }
fn array_mut<const N: usize>(values: &mut [f64]) -> &mut [f64; N] { values.try_into().unwrap() }
fn main() {
    let arguments: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&arguments[1]).unwrap();
    let numbers: Vec<f64> = bytes.chunks_exact(8).map(|b| f64::from_ne_bytes(b.try_into().unwrap())).collect();
    let mut rest = numbers.as_slice();
    let mut results: Vec<f64> = Vec::new();
    for &(run, n, from, to) in FUNCTIONS {
        for _ in 0..n {
            let (input, others) = rest.split_at(from);
            let mut output = vec![0.0; to];
            run(input, &mut output);
            results.extend(output);
            rest = others;
        }
    }
    let bytes: Vec<u8> = results.iter().flat_map(|x| x.to_ne_bytes()).collect();
    std::fs::write(&arguments[2], bytes).unwrap();
}
",
    );
    let mut entries = String::new();
    for (k, function) in functions.iter().enumerate() {
        text.push_str(&match function.is_batch() {
            true => rust_batch(k, function),
            false => rust_single(k, function),
        });
        let (n, from, to) = calls(function);
        entries.push_str(&format!("    (run{k}, {n}, {from}, {to}),\n"));
    }
    text.push_str(&format!("const FUNCTIONS: &[Entry] = &[\n{entries}];\n"));
    text
}

fn rust_single(k: usize, function: &Function) -> String {
    let mut body = String::new();
    let mut arguments = Vec::new();
    let outputs = offsets(&function.program.outputs);
    let mut rest = "out".to_owned();
    for (j, (name, _, len)) in outputs.iter().enumerate() {
        body.push_str(&format!(
            "    let (o{j}, rest{j}) = {rest}.split_at_mut({len});\n"
        ));
        rest = format!("rest{j}");
        for (input, from, _) in offsets(&function.program.inputs) {
            if input == *name {
                body.push_str(&format!(
                    "    o{j}.copy_from_slice(&input[{from}..{}]);\n",
                    from + len
                ));
            }
        }
    }
    body.push_str(&format!("    let _ = {rest};\n"));
    for (name, at, len) in offsets(&function.program.inputs) {
        let in_place = outputs.iter().position(|(output, ..)| *output == name);
        arguments.push(match in_place {
            Some(j) => format!("array_mut(o{j})"),
            None if name == "h" => format!("input[{at}]"),
            None => format!("array(&input[{at}..{}])", at + len),
        });
    }
    if !function.is_step() {
        arguments.extend((0..outputs.len()).map(|j| format!("array_mut(o{j})")));
    }
    if function.name.ends_with("_jacobian") && outputs.len() == 1 {
        arguments.push("&mut []".to_owned());
    }
    format!(
        "fn run{k}(input: &[f64], out: &mut [f64]) {{\n{body}    {}::{}({});\n}}\n",
        function.model,
        function.name,
        arguments.join(", ")
    )
}
