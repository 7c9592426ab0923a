//! Names that are safe in generated C, C++ and Rust.

use super::*;

/// Longest identifier in bytes, so that names made of model, phase and function stay readable.
pub(crate) const MAX_IDENTIFIER_LEN: usize = 40;

/// A name which is an identifier in C, C++ and Rust, and neither a keyword nor reserved there.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Identifier(String);

#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{0}")]
pub struct IdentifierError(String);

impl Identifier {
    /// The identifier that a name of the model file stands for: `-`, `.` and space become `_`.
    pub fn from_name(name: &str) -> Result<Self, IdentifierError> {
        let length = name.len();
        let allowed = |c: char| c.is_ascii_alphanumeric() || "_-. ".contains(c);
        let foreign = name.char_indices().find(|&(_, c)| !allowed(c));
        let identifier = name.replace(['-', '.', ' '], "_");
        let lower = identifier.to_ascii_lowercase();
        let is_listed = |(_, words): &&(&str, &str)| words.split(' ').any(|word| word == lower);
        // C's library has all functions of the algebra under the same names, but for the sign.
        let of_algebra = Function::ALL.into_iter().filter(|&f| f != Function::Sign);
        let is_function = of_algebra.map(Function::name).any(|name| name == lower);
        let refusal = if name.is_empty() {
            "it is empty".to_owned()
        } else if length > MAX_IDENTIFIER_LEN {
            format!("it has {length} bytes, expected at most {MAX_IDENTIFIER_LEN}")
        } else if let Some((position, found)) = foreign {
            format!(
                "found {found:?} at byte {position}, expected ASCII letters, digits, `_`, `-`, `.` or space"
            )
        } else if let Some(first) = name.chars().next().filter(|c| !c.is_ascii_alphabetic()) {
            format!("it begins with {first:?}, expected an ASCII letter")
        } else if identifier.contains("__") {
            format!("`{identifier}` has two underscores in a row, which C++ reserves for itself")
        } else if identifier.ends_with('_') {
            format!("`{identifier}` ends with an underscore, expected a letter or digit at the end")
        } else if let Some((language, _)) = KEYWORDS.iter().find(is_listed) {
            format!("`{identifier}` is a keyword of {language}")
        } else if let Some((owner, _)) = TAKEN.iter().find(is_listed) {
            format!("`{identifier}` is the name of {owner}")
        } else if is_function {
            format!("`{identifier}` is the name of a standard function or macro of C")
        } else {
            return Ok(Self(identifier));
        };
        Err(IdentifierError(refusal))
    }

    pub fn as_str(&self) -> &str {
        &self.0
    }

    pub(crate) fn upper(&self) -> String {
        self.0.to_ascii_uppercase()
    }
}

impl fmt::Display for Identifier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

pub fn check_name(name: &str) -> Result<()> {
    identifier_of("model name", name).map(|_| ())
}

pub(super) fn identifier_of(what: &str, name: &str) -> Result<Identifier> {
    Identifier::from_name(name).map_err(|source| ModelError::Name {
        what: what.to_owned(),
        name: name.chars().take(80).collect(),
        source,
    })
}

/// Keywords by language, lower case (`_Bool` and its like cannot begin a name anyway).
const KEYWORDS: [(&str, &str); 3] = [
    (
        "C",
        "auto break case char const continue default do double else enum extern float for goto \
         if inline int long register restrict return short signed sizeof static struct switch \
         typedef union unsigned void volatile while asm fortran typeof constexpr nullptr bool \
         true false alignas alignof static_assert thread_local typeof_unqual",
    ),
    (
        "C++",
        "and and_eq bitand bitor catch char8_t char16_t char32_t class co_await co_return \
         co_yield compl concept consteval constinit const_cast decltype delete dynamic_cast \
         explicit export friend mutable namespace new noexcept not not_eq operator or or_eq \
         private protected public reinterpret_cast requires static_cast template this throw try \
         typeid typename using virtual wchar_t xor xor_eq import module",
    ),
    (
        "Rust",
        "abstract as async await become box crate dyn final fn gen impl in let loop macro match \
         mod move mut override priv pub ref self super trait type unsafe unsized use virtual \
         where yield raw safe macro_rules",
    ),
];

/// Names of files, crates and devices that a generated file must not shadow, lower case.
const TAKEN: [(&str, &str); 4] = [
    (
        "a standard C header",
        "assert complex ctype errno fenv inttypes iso646 limits locale math setjmp signal \
         stdalign stdarg stdatomic stdbit stdbool stdckdint stddef stdint stdio stdlib \
         stdnoreturn string tgmath threads time uchar wchar wctype",
    ),
    (
        "a standard function or macro of C",
        "main null eof errno fabs pow isfinite isnan system",
    ),
    (
        "a crate that generated Rust builds on",
        "std core alloc proc_macro test libm clarabel romc",
    ),
    (
        "a device file of Windows",
        "con prn aux nul com1 com2 com3 com4 com5 com6 com7 com8 com9 lpt1 lpt2 lpt3 lpt4 lpt5 \
         lpt6 lpt7 lpt8 lpt9",
    ),
];
