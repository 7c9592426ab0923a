//! `romc check`: two files in, equal or a point of difference out.

use super::*;
use crate::check::{
    CheckDomain, CheckError, CheckOptions, Comparison, Gap, Side, TermDifference, Verdict, compare,
    read_sides,
};

pub(super) fn run(arguments: &CheckArguments) -> Result<Answer> {
    let options = CheckOptions {
        exact: arguments.exact,
        symbols: SymbolNames::parse(&arguments.symbols)?,
        domain: domain(arguments)?,
    };
    let [left, right] = read_sides([&arguments.left, &arguments.right], &options)?;
    let comparison = compare(&left, &right, &options);
    let phases: Vec<&str> = (comparison.phases.iter().map(|phase| phase.name.as_str())).collect();
    let foreign = (options.domain).foreign(&phases, left.latent_dim.max(right.latent_dim));
    if let (Some(path), Some(message)) = (&arguments.domain, foreign) {
        let file = path.display().to_string();
        return Err(CheckError::File(ImportError::text(&file, Place::Whole, message)).into());
    }
    Ok(answer(&left, &right, &comparison))
}

fn domain(arguments: &CheckArguments) -> Result<CheckDomain, CheckError> {
    let Some(path) = &arguments.domain else {
        return Ok(CheckDomain::default());
    };
    let file = path.display().to_string();
    let text = read_toml(path);
    let text = text.map_err(|source| ImportError::io(&file, "read the file", source))?;
    Ok(CheckDomain::from_toml(path, &text)?)
}

fn answer(left: &Side, right: &Side, comparison: &Comparison) -> Answer {
    let mut text = format!("A: {}\nB: {}\n", left.file, right.file);
    let mut phases = Vec::new();
    for phase in &comparison.phases {
        let _ = writeln!(text, "\nphase {}", phase.name);
        let mut equations = Vec::new();
        for equation in &phase.equations {
            let (words, verdict) = described(&equation.verdict);
            let words = format!("  {}: {words}", equation.output);
            text.extend(words.lines().map(fitted));
            text += &dropping(&equation.verdict, [left, right]);
            let mut entry = json!({ "equation": equation.output });
            extend(&mut entry, verdict);
            if let Some(gap) = &equation.one_sided {
                let is_of_second = gap.left.is_nan();
                let (has, lacks, at) = (side(is_of_second), side(!is_of_second), place(gap));
                text += &format!("    note: {has} has a value at {at}, {lacks} has none\n");
                entry["one_sided"] = gap_json(gap);
            }
            equations.push(entry);
        }
        phases.push(json!({ "phase": phase.name, "equations": equations }));
    }
    let count = |wanted: fn(&Verdict) -> bool| comparison.verdicts().filter(|v| wanted(v)).count();
    let (n, exact) = (count(|_| true), count(|verdict| *verdict == Verdict::Equal));
    let (all, equal) = (counted(n, "equation"), count(Verdict::is_equal));
    let rounded = match equal - exact {
        0 => String::new(),
        n => format!(", {n} of them up to the printed digits"),
    };
    let is_equal = comparison.is_equal();
    let (are, of_all) = match is_equal {
        true => ("are", all),
        false => ("are not", format!("{equal} of {all}")),
    };
    text += &format!("\nA and B {are} equal: {of_all} proven equal{rounded}\n");
    let json = json!({
        "files": [&left.file, &right.file],
        "equal": is_equal,
        "exact": exact == n,
        "phases": phases,
    });
    Answer::new(text, json).failed_if(!is_equal)
}

/// Notes on the files in print that lack a term of the other: rounding may have dropped it.
fn dropping(verdict: &Verdict, [left, right]: [&Side; 2]) -> String {
    let terms: &[TermDifference] = match verdict {
        Verdict::Different(difference) => &difference.terms,
        Verdict::Undecided(_, terms) => terms,
        Verdict::Equal | Verdict::EqualAsPrinted(_) | Verdict::Missing(_) => &[],
    };
    let lacks = |of: fn(&TermDifference) -> f64| terms.iter().any(|term| of(term) == 0.0);
    let files = [
        ("A", left, lacks(|term| term.left)),
        ("B", right, lacks(|term| term.right)),
    ];
    let dropping = (files.into_iter()).filter(|(_, file, lacks)| file.is_rounded && *lacks);
    let words = "has rounded decimals, and terms that round to zero are not printed";
    let notes = dropping.map(|(letter, side, _)| format!("{letter} ({}) {words}", side.file));
    lines("    note: ", notes)
}

fn side(is_second: bool) -> &'static str {
    if is_second { "B" } else { "A" }
}

fn described(verdict: &Verdict) -> (String, Value) {
    match verdict {
        Verdict::Equal => ("proven equal".to_owned(), json!({ "verdict": "equal" })),
        Verdict::EqualAsPrinted(rounding) => {
            let most = significant(*rounding);
            let text = format!(
                "proven equal up to the printed digits (coefficients differ by at most {most})"
            );
            let json = json!({ "verdict": "equal as printed", "rounding": rounding });
            (text, json)
        }
        Verdict::Different(difference) => {
            let how = match difference.beside_rounding {
                true => "different in terms that rounding does not explain,",
                false => "different",
            };
            let (gap, terms) = (gap_text(&difference.gap), terms_text(&difference.terms));
            let json = json!({
                "verdict": "different",
                "point": gap_json(&difference.gap),
                "terms": difference.terms,
                "beside_rounding": difference.beside_rounding,
            });
            (format!("{how}{gap}{terms}"), json)
        }
        Verdict::Undecided(largest, terms) => {
            let seen = match largest {
                Some(gap) => format!("the largest difference seen is{}", gap_text(gap)),
                None => "no difference was seen at any point".to_owned(),
            };
            let text =
                "not decided: no proof, and no point where the difference is beyond rounding";
            let text = format!("{text}; {seen}{}", terms_text(terms));
            let point = largest.as_ref().map(gap_json);
            let json = json!({ "verdict": "not decided", "point": point, "terms": terms });
            (text, json)
        }
        Verdict::Missing(second) => {
            let file = side(*second);
            let json = json!({ "verdict": "missing", "missing_in": file });
            (format!("missing in {file}"), json)
        }
    }
}

fn gap_text(gap: &Gap) -> String {
    let Gap { left, right, .. } = gap;
    let (at, difference) = (place(gap), significant(left - right));
    let [left, right] = [*left, *right].map(number);
    format!(" at {at}\n    A = {left}, B = {right}, A - B = {difference}")
}

fn number(value: f64) -> String {
    match value.abs() {
        0.0 | 1e-5..1e16 => value.to_string(),
        _ => format!("{value:e}"),
    }
}

fn place(gap: &Gap) -> String {
    let values: Vec<String> = (gap.point.iter())
        .map(|(name, value)| format!("{name} = {}", number(*value)))
        .collect();
    match values.is_empty() {
        true => "every point".to_owned(),
        false => values.join(", "),
    }
}

fn terms_text(terms: &[TermDifference]) -> String {
    // A term that is not there has the coefficient 0.
    let coefficient = |value: f64, file: &str| match value {
        0.0 => format!("not in {file}"),
        _ => format!("{} in {file}", number(value)),
    };
    let lines = terms.iter().map(|term| {
        let (left, right) = (coefficient(term.left, "A"), coefficient(term.right, "B"));
        format!("\n    {}: {left}, {right}", term.term)
    });
    lines.collect()
}

fn gap_json(gap: &Gap) -> Value {
    json!({ "at": gap.point, "a": gap.left, "b": gap.right, "difference": gap.left - gap.right })
}
