//! Accepted constructs with their meaning, and refused constructs with their place.

use romc::files::Place;
use romc::import::equations::Sections;
use romc::import::{Format, ImportError, SymbolNames, read_equations};
use romc::symbolic::ExprPool;

/// Phases with the texts of their right-hand sides.
type Phases = Vec<(Option<String>, Vec<String>)>;

fn read(file: &str, text: &str, names: &SymbolNames) -> Result<Sections, ImportError> {
    let known = ["contact", "flight", "rear stance"].map(str::to_owned);
    read_equations(file, Format::Latex, text.as_bytes(), names, &known)
}

fn named(text: &str, names: &[&str]) -> Result<Phases, ImportError> {
    let names = SymbolNames::parse(names).expect("names of the test");
    let sections = read("paper.tex", text, &names)?;
    let mut pool = ExprPool::new();
    let mut found = Vec::new();
    for section in &sections.sections {
        let mut texts = Vec::new();
        for equation in &section.equations {
            let expr = pool
                .parse(&equation.text(), &|_| true)
                .expect("it was read");
            texts.push(pool.display(expr).to_string());
        }
        found.push((section.phase.clone(), texts));
    }
    Ok(found)
}

#[test]
fn derivatives_may_be_primes_fractions_or_dots_and_stand_in_a_line() {
    let expected = [(None, vec!["u1 + dz2 - z2^3".to_owned(), "dz1^2".to_owned()])];
    for text in [
        r"\[\ddot z_1 = \dot z_2 - z_2^3 + u_1\] \[\ddot z_2 = \dot z_1^2\]",
        r"\[z_1'' = z_2' - z_2^3 + u_1\] \[z_2'' = z_1'^2\]",
        r"\[z''_1 = z'_2 - z_2^3 + u_1\] \[{z_2}^{\prime\prime} = {z_1^\prime}^2\]",
        r"\[\frac{d^2 z_1}{dt^2} = \frac{dz_2}{dt} - z_2^3 + u_1\] \[\frac{d^2}{dt^2} z_2 = \left(\frac{d}{dt} z_1\right)^2\]",
        r"\[\dfrac{\mathrm{d}^{2}}{\mathrm{d}t^{2}} z_1 = \tfrac{\mathrm d}{\mathrm d t} z_2 - z_2^3 + u_1\]
          \[\frac{d^2 z_2}{dt^2} = \left(\frac{dz_1}{dt}\right)^2\]",
        r"\[\frac{\partial^2 z_1}{\partial t^2} = \frac{\partial z_2}{\partial t} - z_2^3 + u_1\] \[z_2'' = z_1'^2\]",
        r"The model is $\ddot z_1 = \dot z_2 - z_2^3 + u_1$ and \(z_2'' = \dot z_1^2\), see $x = 3$.",
    ] {
        let found = named(text, &[]).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(found, expected, "{text}");
    }
    // Derivatives that are not with respect to time are kept, and refused at their place.
    for (text, column) in [
        (r"\[\ddot z_1 = \frac{d z_1}{dx}\]", 21),
        (r"\[\ddot z_1 = \frac{d^2 z_1}{dt}\]", 21),
        (r"\[\ddot z_1 = (z_1)'\]", 20),
        (r"\[\ddot z_1 = \dot z_1'\]", 15),
    ] {
        let error = named(text, &[]).expect_err(text).to_string();
        assert!(
            error.contains(&format!("paper.tex:1:{column}:")),
            "{text}: {error}"
        );
    }
}

/// The one right-hand side of `\ddot z_1`; a second equation introduces the other variables.
fn right_side(latex: &str) -> String {
    let text = format!("\\[\\ddot z_1 = {latex}\\]\n\\[\\ddot z_2 = 0\\]");
    let found = named(&text, &[]).unwrap_or_else(|error| panic!("{latex}: {error}"));
    found[0].1[0].clone()
}

/// Printed forms and their meaning.
const MEANINGS: &str = r"
0.36 - 0.16\dot{z}_1 - 0.75\sin\left(\dot{z}_1\right) + 0.11u_1 => 0.36 - 0.16*dz1 + 0.11*u1 - 0.75*sin(dz1)
-\sin\dot z_1\cos 2z_2 + \tanh\!\bigl(z_1\bigr) => tanh(z1) - cos(2*z2)*sin(dz1)
\frac{1}{2} z_1 + \frac12 z_2 + \dfrac{z_1}{1+z_2^2} => z1/2 + z2/2 + z1/(1 + z2^2)
\sin^2 z_1 + \cos^{2}(\dot z_{2}) => sin(z1)^2 + cos(dz2)^2
{\dot z}_1 + \dot{z_2} + \dot{z}_{2}^{3} + z^2_1 => dz1 + dz2 + z1^2 + dz2^3
\num{1.2e-3} z_1 + 1.5 \times 10^{-3} z_2 - \num{-2} => 2 + 0.0012*z1 + 0.0015*z2
e^{-z_1} + \exp(z_2)\,\mathrm{e}^{z_1} + \exp(z_1)^{2} => exp(-z1) + exp(z1)^2 + exp(z1)*exp(z2)
|z_1| + \left|\dot z_1 - 1\right| + \lvert z_2 \rvert u_1 => u1*abs(z2) + abs(z1) + abs(-1 + dz1)
\sqrt{z_1} + \sqrt[4]{z_2} + \ln z_1 + \log(z_2) => z2^(1/4) + log(z1) + log(z2) + sqrt(z1)
\sqrt[3]{z_1} + \sqrt[5]{z_2 - 1}^2 => abs(z1)^(1/3)*sign(z1) + (abs(-1 + z2)^(1/5)*sign(-1 + z2))^2
\operatorname{sgn}(z_1) + \mathop{\mathrm{sgn}}(\dot z_1) => sign(z1) + sign(dz1)
2 \cdot 3 z_1 * z_2 \times u_2 => 6*z1*z2*u2
z_1(z_1 + 1)\left[2 - z_2\right] => (1 + z1)*z1*(2 - z2)
\begin{aligned}[t] & z_1 \\[2pt] & {} - 2 z_2, \end{aligned} \tag{25}\label{x} => z1 - 2*z2
z_1 \quad \text{in contact,} => z1
z_1(t) + u_{\mathrm{lat},2} + z_1/2 + \frac{1}{2} z_2 => z1 + z1/2 + z2/2 + u2
\sin(z_1) z_2 + \sin{z_1} u_1 + \sin z_1^2 => z2*sin(z1) + u1*sin(z1) + sin(z1^2)
z_1^{-2} + z_1^{1/2} + (z_1)^2 => z1^2 + z1^(-2) + sqrt(z1)
- - z_1 + -z_2 => z1 - z2
\frac12\frac{1}{3} z_1 + \frac{d}{dt} z_1 + 1/2 \cdot z_2 => z1/6 + dz1 + z2/2
\sec z_1 + \csc^2(z_2) + 2\cot(2 z_1) => 1/cos(z1) + 1/sin(z2)^2 + 2/tan(2*z1)
\sinh(z_1 + 1) + \cosh^2 z_2 => (exp(z1 + 1) - exp(-(z1 + 1)))/2 + ((exp(z2) + exp(-z2))/2)^2
0.75 sin(\dot z_1) + cos^2(z_1) - tanh\left(z_2\right) => 0.75*sin(dz1) + cos(z1)^2 - tanh(z2)
0{,}36 z_1 + 12{,}5 => 12.5 + 0.36*z1
0.12{345} z_1 + 1{.}5 + {0}.5 z_2 => 1.5 + 0.12345*z1 + 0.5*z2
1{}5 z_1 + 0.\mathrm{25} z_2 + 1\text{2}\mathbf 3 => 123 + 15*z1 + 0.25*z2
1 5 z_1 + 1.5{0} \times {1}0^{-{3}} z_2 + 1{2}^2 => 144 + 15*z1 + 0.0015*z2
\num{1,5} z_1 + \num{1 000} z_2 + \num{1.2 d-3} => 0.0012 + 1.5*z1 + 1000*z2
2\pi z_1 => 6.283185307179586*z1
\left( z_1 \right. \\ \left. {} + z_2 \right) u_1 => u1*(z1 + z2)
";

#[test]
fn constructs_mean_what_they_print() {
    let of_unicode = [
        ("2z_1 − 3·z_2 % a comment\n + u_1", "2*z1 - 3*z2 + u1"),
        (
            "ż₁ − z₂² + u_1·z₁⁻¹ + 1.5e−3 z\u{307}₂",
            "dz1 - z2^2 + u1/z1 + 0.0015*dz2",
        ),
    ];
    let meanings = MEANINGS.trim().lines();
    let meanings = meanings.map(|line| line.split_once(" => ").expect(line));
    for (latex, expected) in meanings.chain(of_unicode) {
        let mut pool = ExprPool::new();
        let expected = pool.parse(expected, &|_| true).expect(expected);
        assert_eq!(
            right_side(latex),
            pool.display(expected).to_string(),
            "{latex}"
        );
    }
}

#[test]
fn unreadable_constructs_are_named_with_their_place() {
    for (latex, column, found) in [
        (r"z_1 + \arcsin z_1", 19, r"`\arcsin`"),
        (r"cosec(z_1)", 13, "`c`"),
        (r"\sin z_1 u_1", 22, "`u`"),
        (r"\sin 2 \cdot z_1", 20, r"`\cdot`"),
        (r"z_1/z_2 u_1", 21, "`u`"),
        (r"z_1 0.5", 17, "`0.5`"),
        (r"z_10", 16, "`0`"),
        (r"q_1", 13, "`q_1`"),
        (r"\ddot z_2", 13, r"`\ddot z_2`"),
        (r"\frac{1}{", 21, "`{` without its partner"),
        (r"(z_1 + 1", 20, "the end of the equation"),
        (r"\left(z_1 + 1)", 26, "`)`"),
        (r"z_1 = 2", 17, "`=`"),
        (r"\begin{array}{l} 1 \end{array}", 13, r"`\begin{array}`"),
        (r"z_1 \pm 1", 17, r"`\pm`"),
        (r"\sin^{-1} z_1", 19, "`-`"),
        (r"1{,}500 z_1", 15, "`,`"),
        (r"z_1^2^3", 18, "`^`"),
        (r"z_1^{(2)}", 18, "`(`"),
        (r"\sin z_1/2", 21, "`/`"),
        (r"\sin{z_1}^2", 22, "`^`"),
        (r"\sin{z_1 + 1}", 22, "`+`"),
        (r"z_1 + 3 \quad (2)", 27, "`(`"),
        (r"z_1''", 13, r"`\ddot z_1`"),
        (r"(z_1)'", 18, "`'`"),
        (r"{z_1 + 1} u_1", 18, "`+`"),
        (r"z_{i}", 13, "`z_i`"),
        (r"\dot{z_1 + 1}", 17, "`{`"),
        (r"\pi_1", 13, "`pi_1`"),
        (r"0.12{3^2}", 17, "`{`"),
        (r"\frac{1}{2}{3} z_1", 25, "`3`"),
        (r"z_1{2}", 17, "`2`"),
        (r"1\,000 z_1", 16, "`000`"),
        (r"1{e}5 z_1", 14, "`e`"),
        (r"\sin{2} z_1", 21, "`z`"),
        (r"\num{1.5(2)}", 18, "`1.5`"),
        (r"\num[round-precision=1]{1.25}", 17, "`[`"),
        (r"\dots", 13, r"`\dots`"),
        (r"z_1 \text{if} z_2", 27, "`z`"),
        (r"z_3", 13, "`z3`"),
        (r"1 +", 15, "the end of the equation"),
        (r"1/2 \times 10^{-3} z_1", 15, "`2`"),
        (r"2/3z_1", 16, "`z`"),
        (r"1/2 (z_1 + 1)", 17, "`(`"),
        (
            r"\begin{cases} z_1 & \\ -z_1 & \end{cases}",
            13,
            r"`\begin{cases}`",
        ),
        (r"z_1 & u_1", 19, "`u`"),
        (r"z_1 \\ z_2", 20, "`z`"),
        (r"z_1 - \\ &- z_2", 23, "`-`"),
        (r"\frac{d}{dt} z_1^2", 19, "`d`"),
        (r"\frac{d}{dt} z_1 z_2", 19, "`d`"),
        (r"0.36 \num{-0.16} z_1", 18, r"`\num`"),
        (r"\num{-0.5}^2", 23, "`^`"),
        (r"1\frac{1}{2} z_1", 14, r"`\frac`"),
        (r"{\sin z_1}^2", 23, "`^`"),
    ] {
        let text = format!("\\[\\ddot z_1={latex}\\]\n\\[\\ddot z_2 = 0\\]");
        let error = named(&text, &[]).expect_err(latex);
        let start = format!("paper.tex:1:{column}: found {found}, expected ");
        assert!(error.to_string().starts_with(&start), "{latex}: {error}");
    }
}

#[test]
fn equations_are_read_in_every_layout_and_relation() {
    let expected: Phases = vec![(None, vec!["dz1".to_owned(), "2*u2".to_owned()])];
    for text in [
        r"\[ \left\{\begin{array}{@{}rcl@{}} \ddot z_1 &=& \dot z_1 \\ \ddot z_2 &=& 2u_2 \end{array}\right. \]",
        r"\begin{IEEEeqnarray}{rCl} \ddot z_1 &=& \dot z_1 \IEEEyesnumber \\ \ddot z_2 &=& 2u_2 \end{IEEEeqnarray}",
        r"\begin{alignat}{2} \ddot z_1 &= \dot z_1 \label{eq:first} \\ \ddot z_2 &= 2u_2 \label{eq:second} \end{alignat}",
        r"\[ \ddot z_1 := \dot z_1 \] \[ \ddot z_2 \coloneqq 2u_2 \]",
        r"\[ \ddot z_1 \approx \dot z_1 \] \[ \ddot z_2 \triangleq 2u_2 \]",
        r"\begin{equation} \ddot z_1 = \dot z_1 \label{eq:z1} \end{equation}
          \begin{equation} \ddot z_2 = 2u_2 \label{eq:z2} \end{equation}",
        "\\[ z\u{308}₁ = ż₁ \\] \\[ z\u{308}₂ = 2u₂ \\]",
    ] {
        let found = named(text, &[]).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(found, expected, "{text}");
    }
    let vector = r"\[ \begin{bmatrix} \ddot z_1 \\ \ddot z_2 \end{bmatrix} = 2u \]";
    let error = named(vector, &[]).expect_err("a vector").to_string();
    let start =
        r"paper.tex:1:20: found a second derivative without `=` behind its variable, expected ";
    assert!(error.starts_with(start), "{error}");
}

#[test]
fn documents_are_read_with_their_macros_and_phases() {
    let text = r"
\documentclass{article} \newcommand{\dz}[1]{\dot z_{#1}} \def\half{\frac12}
\DeclareMathOperator{\sgn}{sgn}
\begin{document} Costs \$5 and $\ddot q = 1$. \begin{equation} \dot x = A x, \quad z = W_e q \end{equation}
\begin{equation}\label{eq:m:contact}\left\{\begin{aligned}
 \ddot z_1 &= \half \dz{1} \\ & \qquad - \sgn(\dz2), \\ \ddot z_2 &= 0
\end{aligned}\right.\end{equation}
\begin{verbatim} \[ \ddot z_1 = broken \] \end{verbatim}
\begin{align} \ddot z_1 &= 1 \label{eq:m:flight:1} \\ \ddot z_2 &= u_2 \label{eq:m:flight:2} \end{align}
% Phase rear stance: two feet.
\[ \ddot z_1 = 3, \qquad \ddot z_2 = 4. \]
\end{document}";
    let found = named(text, &[]).unwrap_or_else(|error| panic!("{error}"));
    let texts = |equations: &[&str]| equations.iter().map(|text| (*text).to_owned()).collect();
    assert_eq!(
        found,
        [
            (
                Some("contact".to_owned()),
                texts(&["1/2*dz1 - sign(dz2)", "0"])
            ),
            (Some("flight".to_owned()), texts(&["1", "u2"])),
            (Some("rear stance".to_owned()), texts(&["3", "4"])),
        ]
    );
}

/// Documents, and the equations read from them or the reason of refusal.
const PRINTED: [(&str, &str); 51] = [
    (
        r"\newcommand{\k}{2}\begingroup\renewcommand{\k}{9}\endgroup\[\ddot z_1=\k z_1\]",
        "2*z1",
    ),
    (
        r"\def\k{2}{\def\k{9}}\begin{center}\def\k{9}\end{center}$\def\k{9}$\[\ddot z_1=1\k z_1\]",
        "12*z1",
    ),
    (r"\def\k{2}{\gdef\k{9}}\[\ddot z_1=\k z_1\]", "9*z1"),
    (
        r"\def\k{2}\[\ddot z_1=\left(\def\k{9}\k z_1\right)+\frac{\def\k{8}\k}{\k}\]",
        "4 + 9*z1",
    ),
    (
        r"\def\k{2}\begin{align}\ddot z_1&=\def\k{9}\k z_1\\&+\k z_1^2\end{align}",
        "9*z1 + 2*z1^2",
    ),
    (
        r"\def\k{2}\begin{align}\ddot z_1&=\k z_1\gdef\k{9}\end{align}",
        r"1:40: found `\gdef` for all rows",
    ),
    (
        r"\def\k{2}\providecommand\k{9}\let\l\k\def\k{9}\[\ddot z_1=\l z_1\]",
        "2*z1",
    ),
    (
        r"\newcommand{\k}[2][5]{#1#2}\[\ddot z_1=\k{2}z_1+\k[3]4\]",
        "34 + 52*z1",
    ),
    (
        r"\def\m#1{\def\k##1{##1#1}}\m7\[\ddot z_1=\k3z_1\]",
        "37*z1",
    ),
    (
        r"\let\old\sin\renewcommand{\sin}[1]{\old(2#1)}\[\ddot z_1=\sin{z_1}\]",
        "sin(2*z1)",
    ),
    (
        r"\newenvironment{m}[1]{\begin{equation}\def\k{#1}}{\end{equation}}\begin{m}{7}\ddot z_1=\k z_1\end{m}",
        "7*z1",
    ),
    (
        r"\newcommand{\be}{\begin{equation}}\let\ee\endequation\be\ddot z_1=z_1\ee",
        "z1",
    ),
    (
        r"\newcommand{\k}{2}\newcommand{\k}{9}\[\ddot z_1=\k z_1\]",
        r"1:49: found `\k`, a macro that is defined already",
    ),
    (
        r"\def\k#1.{9}\[\ddot z_1=\k 3. z_1\]",
        r"1:25: found `\k`, a macro with delimited arguments",
    ),
    (
        r"\def\k{2}\edef\l{\k}\[\ddot z_1=\l z_1\]",
        r"1:33: found `\l`, a macro whose body is expanded",
    ),
    (
        r"\DeclarePairedDelimiter{\abs}{(}{)}\[\ddot z_1=\abs{z_1}\]",
        r"1:48: found `\abs`, a macro of a form",
    ),
    (
        r"{\begingroup}\[\ddot z_1=z_1\]",
        r"1:13: found `}`, expected `\endgroup` for `\begingroup` in line 1",
    ),
    (
        r"\iffalse\[\ddot z_1=9z_1\]\ifx a\else\fi\else\[\ddot z_1=z_1\]\fi",
        "z1",
    ),
    (
        r"\newif\ifa{\atrue}\[\ddot z_1=\ifa 9\else 3\fi z_1\]",
        "3*z1",
    ),
    (
        r"\newif\ifa{\global\atrue}\[\ddot z_1=\unless\ifa 9\else 3\fi z_1\]",
        "3*z1",
    ),
    (
        r"\iffalse\[\ddot z_1=9z_1\]",
        r"1:1: found `\iffalse` without its end",
    ),
    (
        r"\ifnum1>0 \[\ddot z_1=9z_1\]\fi\[\ddot z_1=z_1\]",
        r"1:1: found `\ifnum`, a conditional that is not",
    ),
    (r"\ifpdf\def\k{3}\fi text \[\ddot z_1=z_1\]", "z1"),
    (
        r"\def\k{2}\ifpdf\def\k{3}\fi\[\ddot z_1=\k z_1\]",
        r"1:40: found `\k`, a macro that is defined under",
    ),
    (
        r"\ifthenelse{\boolean{x}}{\[\ddot z_1=9\]}{}\[\ddot z_1=z_1\]",
        r"1:1: found `\ifthenelse`",
    ),
    (
        r"\begin{document}\[\ddot z_1=z_1\]\end{document}\[\ddot z_1=9z_1\]",
        "z1",
    ),
    (
        r"\[\ddot z_1=9\]\begin{document}\[\ddot z_1=z_1\]",
        r"1:3: found `\ddot` before `\begin{document}`",
    ),
    (
        "\\[\\ddot z_1=z_1\\]\n\\endinput\n\\[\\ddot z_1=9z_1\\]",
        "z1",
    ),
    (
        "\\begin{comment}\n\\[\\ddot z_1=9\\] \\fi\n\\end{comment}\n\\verb|\\iffalse|\\[\\ddot z_1=z_1\\]",
        "z1",
    ),
    (r"{\url{a%20b}}\[\ddot z_1=z_1\]", "z1"),
    (
        r"\excludecomment{hide}\begin{hide}\[\ddot z_1=9\]\fi\end{hide}\[\ddot z_1=z_1\]",
        "z1",
    ),
    (
        r"\phantom{$\ddot z_1=9$}\[\phantom{\ddot z_1=9}\ddot z_1=z_1\]",
        "z1",
    ),
    (r"\[\ddot z_1=1\phantom{0}5\]", r"1:25: found `5`"),
    (
        r"\[\ddot z_1=z_1\]\[\text{with $\ddot z_2=9$}\]",
        r"1:20: found an equation in `\text`",
    ),
    (
        r"\sbox{\b}{$\ddot z_1=9$}$\ddot z_1=z_1$",
        r"1:1: found `\sbox`, which keeps mathematics",
    ),
    (
        r"\newcommand{\no}[1]{}\no{\[\ddot z_1=9\]}\[\ddot z_1=z_1\]",
        "z1",
    ),
    (
        r"\sisetup{round-mode=places}\[\ddot z_1=\num{1.25}\]",
        r"1:40: found `\num`, with options",
    ),
    (
        r"\[\ddot z_1=\num[exponent-base=2]{1.5e3}\]",
        r"1:17: found `[`, expected the number as it is printed",
    ),
    (
        r"\newcommand\k{2}\input{macros}\[\ddot z_1=\k z_1\]",
        r"1:17: found `\input`, which prints a file that is not read, expected the document in one file: latexpand paper.tex",
    ),
    (r"\iffalse\input{old}\fi\[\ddot z_1=z_1\]", "z1"),
    (
        r"\newenvironment{h}{\setbox0\vbox\bgroup}{\egroup}\[\ddot z_1=z_1\]\begin{h}\[\ddot z_2=9\]\end{h}",
        r"1:67: found `\setbox`, which keeps mathematics",
    ),
    (
        r"\setbox1=\hbox to 3cm{$\ddot z_1=9$}$\ddot z_1=z_1$",
        r"1:1: found `\setbox`, which keeps mathematics",
    ),
    (
        r"\mathcode`\+=`\-\[\ddot z_1=1+z_1\]",
        r"1:1: found `\mathcode`",
    ),
    (
        r"\[\ddot z_1=z_1\text{ + 3}\]",
        r"1:23: found `+`, expected words behind the equation",
    ),
    (
        r"\[\ddot z_1=z_1\text{$+z_1^2$}\]",
        r"1:23: found `+`, expected words behind the equation",
    ),
    (r"\[\ddot z_1=z_1\text{ for all } \mbox{$z_1$}.\]", "z1"),
    (
        r"\[\ddot z_1=1.5{\times}10^{-3}z_1{+}2{\cdot}z_1{-}{z_1^{-}}\]",
        r"1:58: found `}`",
    ),
    (
        r"\[\ddot z_1{=}1.5{\times}10^{3}z_1{-}2{\cdot}10^{1}{\cdot}z_1^{2}\]",
        "1500*z1 - 20*z1^2",
    ),
    (
        r"\[\ddot z_1=z_1\] as in $\ddot z_1=z_1$, and $\ddot z_2=3$",
        r"1:47: found `\ddot z_2` in a line of the text",
    ),
    (r"\[\ddot z_1=0{\cdot}5z_1\]", r"1:15: found `\cdot`"),
    (
        r"\newcommand{\k}{\ensuremath{2}}\[\ddot z_1=1\textcolor{red}{3}\protect\k z_1\]",
        "132*z1",
    ),
];

#[test]
fn documents_are_read_as_tex_prints_them() {
    for (text, expected) in PRINTED {
        match named(text, &[]) {
            Ok(found) => assert_eq!(found[0].1[0], expected, "{text}"),
            Err(error) => {
                let start = format!("paper.tex:{expected}");
                assert!(error.to_string().starts_with(&start), "{text}: {error}");
            }
        }
    }
}

#[test]
fn markdown_has_mathematics_in_its_lines_and_code_that_is_none() {
    for (text, expected) in [
        (
            "So $\\ddot z_1 = 2 z_1$, for $5 or \\$6, `$\\ddot z_2 = 9$`.",
            &["2*z1"][..],
        ),
        (
            "$`\\ddot z_1 = z_2`$ and\n$\\ddot z_2 = z_1$",
            &["z2", "z1"],
        ),
        (
            "---\ntitle: $\\ddot z_1 = 9$\n---\n[//]: # ($\\ddot z_1 = 9$)\nSo \\(\\ddot z_1 = z_1\\).\n\n    $\\ddot z_1 = 9$\n",
            &["z1"],
        ),
        (
            "1. One\n\n    \\[\\ddot z_1 = z_2\\]\n\nas \\[1\\] and \\[2 say\n<pre>$$\\ddot z_1 = 9$$\n</pre>\n\\[\n\\ddot z_2 = z_1\n\\]\n\n\t$$\\ddot z_1 = 9$$\n",
            &["z2", "z1"],
        ),
        (
            "```{math}\n\\ddot z_1 = z_1\n```\n<code>$$\\ddot z_1 = 9$$</code>",
            &["z1"],
        ),
        (
            "~~~\n$$\\ddot z_1 = 9$$\n~~~\n<!--\n$$\\ddot z_1 = 9$$ -->\n$$\\ddot z_1 = z_1$$",
            &["z1"],
        ),
    ] {
        let read = read("notes.md", text, &SymbolNames::default());
        let read = read.unwrap_or_else(|error| panic!("{text}: {error}"));
        let equations = read.sections.iter().flat_map(|section| &section.equations);
        let texts: Vec<String> = equations
            .map(|equation| equation.text().replace('\n', ""))
            .collect();
        assert_eq!(texts, expected, "{text}");
    }
}

#[test]
fn other_names_stand_for_the_variables_that_they_are_given_to() {
    let text = r"\[\ddot x = \dot x F_{\mathrm{lin},x}, \ddot\theta = \sin\theta - \dot\theta\]";
    let found =
        named(text, &["z1=x", "z2=theta", "u1=F_lin,x"]).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(found[0].1, ["u1*dz1", "-dz2 + sin(z2)"]);
    let error = named(text, &[]).expect_err("x is no variable").to_string();
    assert!(
        error.starts_with(r"paper.tex:1:3: found `\ddot x`, expected"),
        "{error}"
    );
    assert!(
        SymbolNames::parse(&["dz1=v"]).is_err() && SymbolNames::parse(&["z1=x", "z2=x"]).is_err()
    );
    assert_eq!(
        named(r"\[\ddot z = -4z + u\]", &[]).expect("one coordinate")[0].1,
        ["u1 - 4*z1"]
    );
}

#[test]
fn hostile_documents_end_with_an_error() {
    let deep = |open: &str, close: &str| {
        format!(
            "\\[\\ddot z_1 = {}z_1{}\\]",
            open.repeat(50_000),
            close.repeat(50_000)
        )
    };
    for text in [
        deep("(", ")"),
        deep("\\frac{", "}{2}"),
        deep("\\sin ", ""),
        deep("{", "}"),
        deep("|", "|"),
        deep("\\dot{", "}"),
        deep("\\sqrt{", "}"),
        "\\def\\a{\\a\\a}\\[\\ddot z_1 = \\a\\]".to_owned(),
        format!(
            "\\def\\a#1{{{}}}\\[\\ddot z_1 = \\a{{{}}}\\]",
            "#1".repeat(9_000),
            "z_1".repeat(9_000)
        ),
        "\\begin{align}\\ddot z_1 = 1".to_owned(),
        "\\[\\begin{cases}\\ddot z_1 = 1\\]".to_owned(),
        "\\[\\ddot z_1 = 1\\end{cases}\\]".to_owned(),
    ] {
        let short: String = text.chars().take(60).collect();
        let error = named(&text, &[]).expect_err(&short);
        assert!(matches!(error.place, Place::Character(..)), "{error}");
    }
}

#[test]
fn comment_that_names_several_phases_gives_each_the_equations() {
    let text = "% Phases rear stance, flight: two feet; none.\n\\[\\ddot z_1 = u_1\\]\n\
                % Phase contact: any.\n\\[\\ddot z_1 = 2u_1\\]\n";
    let found = named(text, &[]).expect("three phases");
    let phases = [("rear stance", "u1"), ("flight", "u1"), ("contact", "2*u1")];
    let expected = phases.map(|(name, side)| (Some(name.to_owned()), vec![side.to_owned()]));
    assert_eq!(found, expected);
    let again = text.replace("Phase contact", "Phase flight");
    let error = named(&again, &[]).expect_err(&again).to_string();
    assert!(
        error.contains("phase `flight` again, as in line 2"),
        "{error}"
    );
    // A sentence with the same beginning names no phases.
    let sentence = text.replace("Phases rear stance, flight", "Phases follow");
    let found = named(&sentence, &[]).expect("two sections");
    assert_eq!(found[0].0, None);
}
