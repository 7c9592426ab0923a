//! Names that are safe in generated C, C++ and Rust.

use std::fmt;

use thiserror::Error;

use super::error::ModelError;

/// Longest identifier in bytes, so that names made of model, phase and function stay readable.
pub(crate) const MAX_IDENTIFIER_LEN: usize = 40;

/// A name which is an identifier in C, C++ and Rust, and neither a keyword nor reserved there.
///
/// ```
/// use romc::model::Identifier;
///
/// assert_eq!(Identifier::from_name("go1-d4").unwrap().as_str(), "go1_d4");
/// assert!(Identifier::from_name("while").is_err());
/// assert!(Identifier::from_name("x; system(\"x\")").is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Identifier(String);

/// Why a name cannot be an identifier.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "each variant's message names its fields")]
pub enum IdentifierError {
    /// The name has no character.
    #[error("it is empty")]
    Empty,
    /// The name is too long.
    #[error("it has {found} bytes, expected at most {MAX_IDENTIFIER_LEN}")]
    TooLong { found: usize },
    /// A character is not allowed.
    #[error(
        "found {found:?} at byte {position}, expected ASCII letters, digits, `_`, `-`, `.` or space"
    )]
    Character {
        /// Byte offset.
        position: usize,
        found: char,
    },
    /// It does not begin with a letter.
    #[error("it begins with {found:?}, expected an ASCII letter")]
    Start { found: char },
    /// C and C++ reserve it for the implementation.
    #[error("`{identifier}` has two underscores in a row, which C++ reserves for itself")]
    Reserved { identifier: String },
    /// Names that are made of it would have two underscores in a row.
    #[error("`{identifier}` ends with an underscore, expected a letter or digit at the end")]
    End { identifier: String },
    /// It is a keyword.
    #[error("`{identifier}` is a keyword of {language}")]
    Keyword {
        identifier: String,
        language: &'static str,
    },
    /// A header, a crate or a device file has this name already.
    #[error("`{identifier}` is the name of {owner}")]
    Taken {
        identifier: String,
        owner: &'static str,
    },
}

impl Identifier {
    /// The identifier that a name of the model file stands for: `-`, `.` and space become `_`.
    ///
    /// # Errors
    /// Each variant of [`IdentifierError`]; keywords and taken names are compared without case.
    pub fn from_name(name: &str) -> Result<Self, IdentifierError> {
        let first = name.chars().next().ok_or(IdentifierError::Empty)?;
        if name.len() > MAX_IDENTIFIER_LEN {
            return Err(IdentifierError::TooLong { found: name.len() });
        }
        let allowed = |c: char| c.is_ascii_alphanumeric() || "_-. ".contains(c);
        if let Some((position, found)) = name.char_indices().find(|&(_, c)| !allowed(c)) {
            return Err(IdentifierError::Character { position, found });
        }
        if !first.is_ascii_alphabetic() {
            return Err(IdentifierError::Start { found: first });
        }
        let identifier = name.replace(['-', '.', ' '], "_");
        if identifier.contains("__") {
            return Err(IdentifierError::Reserved { identifier });
        }
        if identifier.ends_with('_') {
            return Err(IdentifierError::End { identifier });
        }
        let lower = identifier.to_ascii_lowercase();
        let listed = |lists: &[(&'static str, &str)]| {
            let mut lists = lists.iter();
            lists.find_map(|(name, words)| {
                words.split(' ').any(|word| word == lower).then_some(*name)
            })
        };
        match (listed(&KEYWORDS), listed(&TAKEN)) {
            (Some(language), _) => Err(IdentifierError::Keyword {
                identifier,
                language,
            }),
            (None, Some(owner)) => Err(IdentifierError::Taken { identifier, owner }),
            (None, None) => Ok(Self(identifier)),
        }
    }

    /// The identifier as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The identifier in upper case, as macros are written.
    pub(crate) fn upper(&self) -> String {
        self.0.to_ascii_uppercase()
    }
}

impl fmt::Display for Identifier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Refuses a name that a model cannot have, before one is made.
///
/// # Errors
/// [`ModelError::Name`].
pub fn check_name(name: &str) -> Result<(), ModelError> {
    identifier_of("model name", name).map(|_| ())
}

pub(super) fn identifier_of(what: &str, name: &str) -> Result<Identifier, ModelError> {
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
        "main null eof errno sin cos tan tanh exp log sqrt abs fabs pow isfinite isnan system",
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifier_of_usual_names_replaces_punctuation() {
        for (name, expected) in [
            ("paper-2d", "paper_2d"),
            ("go1.d6", "go1_d6"),
            ("rear stance", "rear_stance"),
            ("A1", "A1"),
        ] {
            assert_eq!(Identifier::from_name(name).unwrap().as_str(), expected);
        }
    }

    #[test]
    fn names_that_are_no_identifiers_are_refused_with_the_reason() {
        use IdentifierError::{Character, Empty, End, Keyword, Reserved, Start, Taken, TooLong};
        let character = |position, found| Character { position, found };
        let keyword = |word: &str, language| Keyword {
            identifier: word.to_owned(),
            language,
        };
        let taken = |word: &str, list: usize| Taken {
            identifier: word.to_owned(),
            owner: TAKEN[list].0,
        };
        let reserved = Reserved {
            identifier: "a__b".to_owned(),
        };
        let end = || End {
            identifier: "a_".to_owned(),
        };
        let long = "a".repeat(41);
        for (name, expected) in [
            ("", Empty),
            (long.as_str(), TooLong { found: 41 }),
            ("x; system(\"x\")", character(1, ';')),
            ("a\nb", character(1, '\n')),
            ("a\u{0}", character(1, '\u{0}')),
            ("z\u{301}", character(1, '\u{301}')),
            ("\\input{x}", character(0, '\\')),
            ("../x", character(2, '/')),
            ("2d", Start { found: '2' }),
            ("_x", Start { found: '_' }),
            ("a-_b", reserved),
            ("a_", end()),
            ("a-", end()),
            ("a.", end()),
            ("a ", end()),
            ("double", keyword("double", "C")),
            ("template", keyword("template", "C++")),
            ("and-eq", keyword("and_eq", "C++")),
            ("loop", keyword("loop", "Rust")),
            ("LOOP", keyword("LOOP", "Rust")),
            ("math", taken("math", 0)),
            ("Stdint", taken("Stdint", 0)),
            ("main", taken("main", 1)),
            ("core", taken("core", 2)),
            ("nul", taken("nul", 3)),
        ] {
            assert_eq!(Identifier::from_name(name), Err(expected), "{name:?}");
        }
    }

    proptest::proptest! {
        #[test]
        fn identifier_of_any_text_is_plain_ascii_or_refused(
            text in proptest::prop_oneof![".{0,50}", "[a-zA-Z0-9_. -]{0,45}"]
        ) {
            if let Ok(identifier) = Identifier::from_name(&text) {
                let name = identifier.as_str();
                assert!(name.starts_with(|c: char| c.is_ascii_alphabetic()));
                assert!(name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'));
                assert!(!name.ends_with('_') && !name.contains("__"));
                assert!(name.len() <= MAX_IDENTIFIER_LEN);
            }
        }
    }
}
