//! Files of learned models that other tools write, and the lines of Python that convert them.

use std::path::{Path, PathBuf};

/// A kind of file that no reader of romc reads as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ForeignFile {
    /// The kind, such as `a PyTorch file`.
    pub what: &'static str,
    /// What to do, with the lines to type; `None` for files that `romc import` reads.
    pub remedy: Option<String>,
    /// Whether the lines make the file that was meant rather than arrays for `romc import`.
    pub(crate) is_packed: bool,
}

/// A row of the table: name of the format, its endings, the test of its bytes, and the lines
/// that convert it. `{file}` stands for the file, `{stem}` for its name without the ending.
struct Kind {
    what: &'static str,
    endings: &'static [&'static str],
    is_content: fn(&[u8]) -> bool,
    lines: &'static str,
}

const NEVER: fn(&[u8]) -> bool = |_| false;

const CHECKPOINT: &str = "\
import numpy, tensorflow as tf
saved = tf.train.load_checkpoint(\"{stem}\")
numpy.savez(\"{stem}.npz\", **{name: saved.get_tensor(name) for name in saved.get_variable_to_shape_map()})";

const HDF5: &str = "\
import h5py, numpy
found = {}
h5py.File(\"{file}\").visititems(lambda name, entry: found.update({name: entry[()]}) if hasattr(entry, \"dtype\") else None)
numpy.savez(\"{stem}.npz\", **found)";

/// The kinds, by content in this order, then by ending.
const KINDS: [Kind; 21] = [
    Kind {
        what: "NumPy arrays (.npz)",
        endings: &[],
        is_content: |b| b.starts_with(b"PK") && has(b, b".npy"),
        lines: "",
    },
    Kind {
        what: "a safetensors file",
        endings: &[],
        is_content: |b| b.len() > 10 && b[6..8] == [0, 0] && b[8..10] == *b"{\"",
        lines: "",
    },
    Kind {
        what: "a TorchScript file",
        endings: &[],
        is_content: |b| b.starts_with(b"PK") && has(b, b"/constants.pkl"),
        lines: "\
import torch, safetensors.torch
saved = torch.jit.load(\"{file}\", map_location=\"cpu\").state_dict()
safetensors.torch.save_file({name: tensor.contiguous() for name, tensor in saved.items()}, \"{stem}.safetensors\")",
    },
    Kind {
        what: "a PyTorch file",
        endings: &["pt", "pth", "ckpt", "bin"],
        is_content: |b| {
            (b.starts_with(b"PK") && has(b, b"/data.pkl"))
                || b.starts_with(b"\x80\x02\x8a\x0a\x6c\xfc\x9c\x46\xf9\x20")
        },
        lines: "\
import torch, safetensors.torch
saved = torch.load(\"{file}\", map_location=\"cpu\", weights_only=True)
saved = next((saved[key] for key in (\"state_dict\", \"model_state_dict\") if key in saved), saved)
safetensors.torch.save_file({name: tensor.contiguous() for name, tensor in saved.items()}, \"{stem}.safetensors\")",
    },
    Kind {
        what: "a TensorFlow SavedModel",
        endings: &["pb"],
        is_content: NEVER,
        lines: "\
import numpy, tensorflow as tf
saved = tf.train.load_checkpoint(\"{folder}/variables/variables\")
numpy.savez(\"{stem}.npz\", **{name: saved.get_tensor(name) for name in saved.get_variable_to_shape_map()})",
    },
    Kind {
        what: "a part of a TensorFlow checkpoint (.index, .meta and .data-00000-of-00001 belong together)",
        endings: &["index", "meta", "data-00000-of-00001"],
        is_content: |b| b.ends_with(b"\x57\xfb\x80\x8b\x24\x75\x47\xdb"),
        lines: CHECKPOINT,
    },
    Kind {
        what: "the list of a TensorFlow run's checkpoints",
        endings: &[],
        is_content: |b| b.starts_with(b"model_checkpoint_path:"),
        lines: "\
import numpy, tensorflow as tf
saved = tf.train.load_checkpoint(tf.train.latest_checkpoint(\"{folder}\"))
numpy.savez(\"{folder}/model.npz\", **{name: saved.get_tensor(name) for name in saved.get_variable_to_shape_map()})",
    },
    Kind {
        what: "a Keras model",
        endings: &["keras"],
        is_content: |b| {
            (b.starts_with(b"PK") && has(b, b"model.weights.h5"))
                || (b.starts_with(HDF5_MAGIC) && has(b, b"keras_version"))
        },
        // In Keras 3 `v.name` is `kernel` for the weights of every layer, and a loaded model's `v.path` lacks the names
        // of the parts of the model: numbers make the names unique.
        lines: "\
import keras, numpy
model = keras.models.load_model(\"{file}\", compile=False)
numpy.savez(\"{stem}.npz\", **{f\"{k}/{v.path}\": v.numpy() for k, v in enumerate(model.variables)})  # Keras 2: v.name",
    },
    Kind {
        what: "a MATLAB file of version 7.3 (HDF5)",
        endings: &[],
        is_content: |b| b.starts_with(b"MATLAB 7.3 MAT-file"),
        lines: HDF5,
    },
    Kind {
        what: "a MATLAB file",
        endings: &["mat"],
        is_content: |b| b.starts_with(b"MATLAB 5.0 MAT-file"),
        lines: "\
import numpy, scipy.io
numpy.savez(\"{stem}.npz\", **{name: value for name, value in scipy.io.loadmat(\"{file}\").items() if name[0] != \"_\"})",
    },
    Kind {
        what: "an HDF5 file",
        endings: &["h5", "hdf5"],
        is_content: |b| b.starts_with(HDF5_MAGIC),
        lines: HDF5,
    },
    Kind {
        what: "a TensorFlow Lite model",
        endings: &["tflite"],
        is_content: |b| b.get(4..8) == Some(b"TFL3"),
        lines: "\
import numpy, tensorflow as tf
net = tf.lite.Interpreter(\"{file}\", experimental_preserve_all_tensors=True)
net.allocate_tensors(); net.invoke()
numpy.savez(\"{stem}.npz\", **{t[\"name\"]: net.get_tensor(t[\"index\"]) for t in net.get_tensor_details()})",
    },
    Kind {
        what: "a single NumPy array (.npy)",
        endings: &["npy"],
        is_content: |b| b.starts_with(b"\x93NUMPY"),
        lines: "\
import numpy
numpy.savez(\"{stem}.npz\", **{\"xi.contact\": numpy.load(\"{file}\")})  # and the other arrays, by their parts",
    },
    Kind {
        what: "a joblib file",
        endings: &["joblib"],
        is_content: |b| matches!(b, [0x80, 2..=5, ..]) && has(b, b"joblib"),
        lines: "\
import joblib, numpy
numpy.savez(\"{stem}.npz\", **joblib.load(\"{file}\"))  # of a dictionary of arrays; runs the file's code: your own files only",
    },
    Kind {
        what: "a Python pickle",
        endings: &["pkl", "pickle"],
        is_content: |b| matches!(b, [0x80, 2..=5, ..]),
        lines: "\
import numpy, pickle
numpy.savez(\"{stem}.npz\", **pickle.load(open(\"{file}\", \"rb\")))  # of a dictionary of arrays; runs the file's code: your own files only
# a fitted PySINDy model, in a shell: python examples/pysindy/export_pysindy.py --model always={file} --output {stem}.npz",
    },
    Kind {
        what: "an ONNX model",
        endings: &["onnx"],
        // Field 1 is the version, field 2 the name of the program that wrote it.
        is_content: |b| match b {
            [0x08, 1..=32, 0x12, length @ 1..=63, name @ ..] => {
                let name = name.get(..usize::from(*length));
                name.is_some_and(|name| name.iter().all(u8::is_ascii_graphic))
            }
            _ => false,
        },
        lines: "\
import numpy, onnx, onnx.numpy_helper
numpy.savez(\"{stem}.npz\", **{t.name: onnx.numpy_helper.to_array(t) for t in onnx.load(\"{file}\").graph.initializer})",
    },
    Kind {
        what: "a pointer of Git LFS in place of the file",
        endings: &[],
        is_content: |b| b.starts_with(b"version https://git-lfs"),
        lines: "git lfs pull --include \"{file}\"",
    },
    Kind {
        what: "a web page in place of the file",
        endings: &[],
        is_content: |b| {
            let start = b.trim_ascii_start();
            let is = |tag: &[u8]| (start.get(..tag.len())).is_some_and(|s| s.eq_ignore_ascii_case(tag));
            is(b"<!doctype html") || is(b"<html")
        },
        lines: "curl -L -o \"{file}\" ADDRESS_OF_THE_RAW_FILE",
    },
    Kind {
        what: "a file packed by gzip",
        endings: &[],
        is_content: |b| b.starts_with(b"\x1f\x8b"),
        lines: "gunzip -c \"{file}\" > \"{stem}\"",
    },
    Kind {
        what: "text in UTF-16",
        endings: &[],
        is_content: |b| b.starts_with(b"\xff\xfe") || b.starts_with(b"\xfe\xff"),
        lines: "iconv -f UTF-16 -t UTF-8 \"{file}\" > utf8.tmp && mv utf8.tmp \"{file}\"",
    },
    Kind {
        what: "a Flax file",
        endings: &["msgpack"],
        is_content: NEVER,
        lines: "\
import flax, numpy
saved = flax.serialization.msgpack_restore(open(\"{file}\", \"rb\").read())
numpy.savez(\"{stem}.npz\", **flax.traverse_util.flatten_dict(saved, sep=\"/\"))",
    },
];

const HDF5_MAGIC: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Bytes at either end of a file in which names are looked for.
const SEARCHED: usize = 1 << 16;

/// Whether the first or last bytes contain a text.
fn has(bytes: &[u8], text: &[u8]) -> bool {
    let ends = [
        &bytes[..bytes.len().min(SEARCHED)],
        &bytes[bytes.len().saturating_sub(SEARCHED)..],
    ];
    let mut windows = ends.iter().flat_map(|end| end.windows(text.len()));
    windows.any(|window| window == text)
}

impl ForeignFile {
    /// The kind of a file by its bytes, else by its ending.
    pub(crate) fn of(path: &Path, bytes: &[u8]) -> Option<Self> {
        Self::of_content(path, bytes).or_else(|| Self::of_path(path))
    }

    /// The kind of a file by its bytes alone.
    pub fn of_content(path: &Path, bytes: &[u8]) -> Option<Self> {
        let kind = KINDS.iter().find(|kind| (kind.is_content)(bytes))?;
        Some(kind.named(path))
    }

    /// The kind of a file by its ending.
    pub fn of_path(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_string_lossy().to_lowercase();
        let kind = (KINDS.iter()).find(|kind| kind.endings.contains(&ending.as_str()))?;
        Some(kind.named(path))
    }

    /// The kind of what cannot be read as a file: the name that the files of a TensorFlow checkpoint
    /// share, or the folder of a SavedModel.
    pub fn of_unreadable(path: &Path) -> Option<Self> {
        let index = PathBuf::from(format!("{}.index", path.display()));
        let parts = [index, path.join("saved_model.pb")];
        let part = parts.iter().find(|part| part.is_file());
        Self::of_path(part.map_or(path, PathBuf::as_path))
    }
}

impl Kind {
    fn named(&self, path: &Path) -> ForeignFile {
        let is_packed = !self.lines.is_empty() && !self.lines.starts_with("import");
        // Within double quotes a shell expands `$` and backticks, Python does not.
        let escaped: &[char] = if is_packed {
            &['\\', '"', '$', '`']
        } else {
            &['\\', '"']
        };
        let text = |path: &Path| {
            let mut text = String::new();
            for character in path.display().to_string().chars() {
                text.extend(escaped.contains(&character).then_some('\\'));
                text.push(character);
            }
            text
        };
        let folder = path
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        let lines = (self.lines)
            .replace("{folder}", &text(folder.unwrap_or(Path::new("."))))
            .replace("{file}", &text(path))
            .replace("{stem}", &text(&path.with_extension("")));
        let lines: String = lines.lines().map(|line| format!("\n    {line}")).collect();
        let intent = match is_packed {
            true => "the file itself; in a shell",
            false => "an .npz or .safetensors file; in Python",
        };
        ForeignFile {
            what: self.what,
            remedy: (!lines.is_empty()).then(|| format!("{intent}:{lines}")),
            is_packed,
        }
    }
}
