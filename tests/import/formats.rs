//! Files of other tools that need a conversion first: the error names their format and prints the lines of code that
//! convert them.

use std::fs;
use std::process::Command;

use crate::command_line::{romc, text};
use crate::tools::answers;

/// Names, contents, and words of the error.
const FILES: [(&str, &[u8], &str, &str); 17] = [
    (
        "net.pt",
        b"PK\x03\x04 net/data.pkl",
        "a PyTorch file",
        "safetensors.torch.save_file",
    ),
    (
        "net.pth",
        b"\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20",
        "a PyTorch file",
        "torch.load(\"net.pth\"",
    ),
    (
        "net.npz",
        b"PK\x03\x04 net/data.pkl",
        "a PyTorch file",
        "torch.load(\"net.npz\"",
    ),
    (
        "script.pt",
        b"PK\x03\x04 s/data.pkl s/constants.pkl",
        "a TorchScript file",
        "torch.jit.load",
    ),
    (
        "run/net.ckpt.index",
        b"\0\0\x57\xfb\x80\x8b\x24\x75\x47\xdb",
        "a TensorFlow checkpoint",
        "tf.train.load_checkpoint(\"run/net.ckpt\")",
    ),
    (
        "net.ckpt.meta",
        b"\x0a\x80",
        "a TensorFlow checkpoint",
        "tf.train.load_checkpoint(\"net.ckpt\")",
    ),
    (
        "net.data-00000-of-00001",
        b"\0\0",
        "a TensorFlow checkpoint",
        "tf.train.load_checkpoint(\"net\")",
    ),
    (
        "checkpoint",
        b"model_checkpoint_path: \"net\"\n",
        "checkpoints",
        "latest_checkpoint(\".\")",
    ),
    (
        "net.onnx",
        b"\x08\x07\x12\x07pytorch",
        "an ONNX model",
        "graph.initializer",
    ),
    (
        "net.mat",
        b"MATLAB 5.0 MAT-file, Platform",
        "a MATLAB file",
        "scipy.io.loadmat",
    ),
    (
        "net.safetensors",
        b"MATLAB 7.3 MAT-file, Platform",
        "7.3 (HDF5)",
        "h5py.File",
    ),
    (
        "net.tflite",
        b"\x1c\0\0\0TFL3",
        "a TensorFlow Lite model",
        "tf.lite.Interpreter",
    ),
    (
        "net.h5",
        b"\x89HDF\r\n\x1a\n keras_version",
        "a Keras model",
        "f\"{k}/{v.path}\"",
    ),
    (
        "net.keras",
        b"PK\x03\x04 model.weights.h5",
        "a Keras model",
        "keras.models.load_model",
    ),
    (
        "net.pkl",
        b"\x80\x04\x95",
        "a Python pickle",
        "export_pysindy.py",
    ),
    (
        "net.joblib",
        b"\x80\x04 joblib.numpy_pickle",
        "a joblib file",
        "joblib.load",
    ),
    (
        "a \"b\".npy",
        b"\x93NUMPY\x01",
        "a single NumPy array",
        "numpy.load(\"a \\\"b\\\".npy\")",
    ),
];

#[test]
fn files_of_other_tools_are_named_with_the_lines_that_convert_them() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::create_dir(folder.path().join("run")).expect("a folder");
    let mut recipes = String::new();
    for (name, bytes, what, lines) in FILES {
        fs::write(folder.path().join(name), bytes).expect("writable");
        for arguments in [
            &["import", name, "--output", "m.json"][..],
            &["inspect", name],
        ] {
            let refused = romc(folder.path(), arguments);
            assert_eq!(refused.status.code(), Some(1), "{name}");
            let said = text(&refused.stderr);
            if arguments[0] == "import" {
                assert!(
                    said.contains(what) && said.contains(lines),
                    "{name}: {said}"
                );
                let code = said.lines().filter_map(|line| line.strip_prefix("    "));
                recipes.extend(code.map(|line| format!("{line}\n")));
            }
        }
    }
    // Named by the common prefix of its files, as in TensorFlow.
    let refused = romc(
        folder.path(),
        &["import", "run/net.ckpt", "--output", "m.json"],
    );
    assert!(text(&refused.stderr).contains("load_checkpoint(\"run/net.ckpt\")"));
    let python = std::env::var("ROMC_PYTHON").unwrap_or("python3".to_owned());
    if answers(Command::new(&python).arg("--version")) {
        let compiles = Command::new(python)
            .args(["-c", "import sys; compile(sys.argv[1], 'recipes', 'exec')"])
            .arg(&recipes)
            .output();
        let compiles = compiles.expect("Python runs");
        assert!(
            compiles.status.success(),
            "{recipes}{}",
            text(&compiles.stderr)
        );
    }
}

#[test]
fn files_that_are_packed_or_another_are_named_with_the_line_for_a_shell() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, bytes, what, line) in [
        (
            "net.npz",
            &b"\n<!DOCTYPE HTML>"[..],
            "a web page",
            "curl -L -o net.npz",
        ),
        ("eq.txt", b"<html>", "a web page", "curl -L -o eq.txt"),
        (
            "net.npz.gz",
            b"\x1f\x8b\x08",
            "packed by gzip",
            "gunzip -c net.npz.gz > net.npz",
        ),
        (
            "$(x)`y`.gz",
            b"\x1f\x8b\x08",
            "packed by gzip",
            "gunzip -c '$(x)`y`.gz' > '$(x)`y`'",
        ),
        (
            "eq.tex",
            b"\xff\xfe\\\0",
            "text in UTF-16",
            "mv utf8.tmp eq.tex",
        ),
    ] {
        fs::write(folder.path().join(name), bytes).expect("writable");
        for arguments in [
            &["import", name, "--output", "m.json"][..],
            &["compile", name, "--out-dir", "out"],
        ] {
            let refused = romc(folder.path(), arguments);
            assert_eq!(refused.status.code(), Some(1), "{name}");
            let said = text(&refused.stderr);
            assert!(said.contains(what) && said.contains(line), "{name}: {said}");
        }
    }
    fs::write(folder.path().join("net.msgpack"), b"\x82\xa6params").expect("writable");
    let refused = romc(
        folder.path(),
        &["import", "net.msgpack", "--output", "m.json"],
    );
    assert!(text(&refused.stderr).contains("flax.serialization.msgpack_restore"));
    // A network is not a log.
    fs::write(folder.path().join("net.pt"), b"PK\x03\x04 net/data.pkl").expect("writable");
    let said = romc(folder.path(), &["inspect", "net.pt"]);
    assert!(text(&said.stderr).contains("found a PyTorch file, expected a model file of romc"));
}

#[test]
fn model_files_that_are_none_are_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    fs::write(folder.path().join("net.pt"), b"PK\x03\x04 net/data.pkl").expect("writable");
    let refused = romc(folder.path(), &["compile", "net.pt", "--out-dir", "out"]);
    assert_eq!(refused.status.code(), Some(1));
    let said = text(&refused.stderr);
    assert!(
        said.contains("found a PyTorch file, expected a model file of romc"),
        "{said}"
    );
    assert!(
        said.contains("romc import") && said.contains("safetensors.torch.save_file"),
        "{said}"
    );
}
