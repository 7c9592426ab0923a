//! Stores tensors and models the ways other programs do.
#![allow(dead_code, reason = "each test binary uses a part")]

use std::io::{Cursor, Write};
use std::path::Path;

use nalgebra::DMatrix;
use romc::artifact;
use romc::import::*;
use romc::model::{LibraryChoice, LibraryOrder, ReducedModel};
use romc::robot::PhasePattern;
use safetensors::tensor::{Dtype, TensorView};
use serde_json::Value;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Type of stored numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    F32,
    F64,
    BigF64,
    Bool,
}

/// How an array of two indices lies in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    C,
    Fortran,
}

/// A tensor before it is stored.
#[derive(Clone, Debug)]
pub struct Stored {
    pub name: String,
    pub shape: Vec<usize>,
    pub bytes: Vec<u8>,
    pub number: Number,
    pub order: Order,
}

pub fn number_bytes(number: Number, value: f64) -> Vec<u8> {
    match number {
        Number::F32 => (value as f32).to_le_bytes().to_vec(),
        Number::F64 => value.to_le_bytes().to_vec(),
        Number::BigF64 => value.to_be_bytes().to_vec(),
        Number::Bool => vec![u8::from(value != 0.0)],
    }
}

/// A list of numbers.
pub fn list(name: &str, values: &[f64]) -> Stored {
    Stored {
        name: name.to_owned(),
        shape: vec![values.len()],
        bytes: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        number: Number::F64,
        order: Order::C,
    }
}

/// A matrix of two indices.
pub fn matrix(name: &str, matrix: &DMatrix<f64>, number: Number, order: Order) -> Stored {
    let values: Vec<f64> = match order {
        Order::C => matrix.transpose().iter().copied().collect(),
        Order::Fortran => matrix.iter().copied().collect(),
    };
    Stored {
        name: name.to_owned(),
        shape: vec![matrix.nrows(), matrix.ncols()],
        bytes: values
            .iter()
            .flat_map(|&v| number_bytes(number, v))
            .collect(),
        number,
        order,
    }
}

/// A matrix of `f64` in C order.
pub fn plain(name: &str, of: &DMatrix<f64>) -> Stored {
    matrix(name, of, Number::F64, Order::C)
}

/// The bytes of a safetensors file.
pub fn safetensors(tensors: &[Stored]) -> Vec<u8> {
    let views = tensors.iter().map(|tensor| {
        let dtype = match tensor.number {
            Number::F32 => Dtype::F32,
            Number::F64 | Number::BigF64 => Dtype::F64,
            Number::Bool => Dtype::BOOL,
        };
        assert_ne!(
            tensor.order,
            Order::Fortran,
            "safetensors has no such order"
        );
        let view = TensorView::new(dtype, tensor.shape.clone(), &tensor.bytes);
        (tensor.name.clone(), view.expect("shape and bytes agree"))
    });
    safetensors::serialize(views, None).expect("tensors of known types")
}

/// The bytes of an `.npy` array.
pub fn npy(tensor: &Stored) -> Vec<u8> {
    let descr = match tensor.number {
        Number::F32 => "<f4",
        Number::F64 => "<f8",
        Number::BigF64 => ">f8",
        Number::Bool => "|b1",
    };
    npy_with(descr, tensor.order, &tensor.shape, &tensor.bytes)
}

pub fn npy_with(descr: &str, order: Order, shape: &[usize], bytes: &[u8]) -> Vec<u8> {
    let fortran = match order {
        Order::C => "False",
        Order::Fortran => "True",
    };
    let dims: String = shape.iter().map(|dim| format!("{dim}, ")).collect();
    let mut header =
        format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': ({dims}), }}");
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    npy.extend((header.len() as u16).to_le_bytes());
    npy.extend(header.as_bytes());
    npy.extend(bytes);
    npy
}

/// The bytes of a zip file.
pub fn zip(members: &[(String, Vec<u8>)], method: CompressionMethod) -> Vec<u8> {
    let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(method);
    for (name, bytes) in members {
        writer
            .start_file(name.as_str(), options)
            .expect("in memory");
        writer.write_all(bytes).expect("in memory");
    }
    writer.finish().expect("in memory").into_inner()
}

/// The bytes of an `.npz` file.
pub fn npz(tensors: &[Stored], method: CompressionMethod) -> Vec<u8> {
    let member = |tensor: &Stored| (format!("{}.npy", tensor.name), npy(tensor));
    let members: Vec<(String, Vec<u8>)> = tensors.iter().map(member).collect();
    zip(&members, method)
}

/// A model file of the repository.
pub fn model(path: &str) -> ReducedModel {
    artifact::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("checked in")
}

/// All that tensors do not carry about a model.
pub fn options_of(model: &ReducedModel) -> ImportOptions {
    let phases = model.phases().iter().map(|phase| PhasePattern {
        name: phase.name.clone(),
        feet: phase.feet.clone(),
    });
    ImportOptions {
        name: model.name().to_owned(),
        description: model.description().to_owned(),
        library: Some(model.library().choice()),
        library_order: matches!(model.library().choice(), LibraryChoice::Standard(_))
            .then_some(LibraryOrder::ROMC),
        phases: phases.collect(),
        scaling: model.scaling().ok().cloned(),
        robot: model.robot().ok(),
        sample_time_s: model.sample_time_s().ok(),
        ..ImportOptions::default()
    }
}

/// Asserts that an import gave this model, bit for bit, without the parts named: those which the
/// way of storing cannot carry.
pub fn assert_same(imported: &Imported, original: &ReducedModel, without: &[&str]) {
    let value = |model: &ReducedModel| -> Value {
        let mut value: Value = serde_json::from_str(&artifact::to_text(model)).expect("JSON");
        let entries = value.as_object_mut().expect("a model file is an object");
        for part in without.iter().chain(&["provenance"]) {
            entries.shift_remove(*part);
        }
        value
    };
    let (found, expected) = (value(&imported.model), value(original));
    assert_eq!(found.to_string(), expected.to_string());
}
