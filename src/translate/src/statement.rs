//! Statements.

use std::collections::BTreeMap;

use syn::spanned::Spanned;
use syn::{Block, Expr, Local, Pat, Stmt};

use crate::Fault;
use crate::expression::Value;
use crate::function::{Instance, Writer};
use crate::text::comment;
use crate::types::Type;

/// Lines of C with their indent.
#[derive(Default)]
pub(crate) struct Lines {
    pub text: String,
    depth: usize,
}

impl Lines {
    pub fn add(&mut self, line: &str) {
        self.text += &format!("{}{line}\n", "    ".repeat(self.depth));
    }

    pub fn open(&mut self, line: &str) {
        self.add(line);
        self.depth += 1;
    }

    pub fn close(&mut self, line: &str) {
        self.depth -= 1;
        self.add(line);
    }
}

impl Writer<'_> {
    /// The statements of a block; the value of its last expression is returned if it is a body.
    pub fn block(
        &mut self,
        instance: &mut Instance<'_>,
        lines: &mut Lines,
        block: &Block,
        is_body: bool,
    ) -> Result<(), Fault> {
        instance.scopes.push(BTreeMap::new());
        let count = block.stmts.len();
        for (number, statement) in block.stmts.iter().enumerate() {
            let above = (self.items).comments_above(instance.function.source, statement);
            for line in comment(&above, "").lines() {
                lines.add(line.trim_end());
            }
            match statement {
                Stmt::Local(local) => self.local(instance, lines, local)?,
                Stmt::Expr(expression, None) if is_body && number + 1 == count => {
                    self.result(instance, lines, expression)?;
                }
                Stmt::Expr(expression, _) => self.statement(instance, lines, expression)?,
                other => return Err(self.outside(instance, other, "an item or macro")),
            }
        }
        instance.scopes.pop();
        Ok(())
    }

    pub fn outside(&self, instance: &Instance<'_>, at: &impl Spanned, what: &str) -> Fault {
        let message = format!("{what} is outside the subset that is translated");
        self.items.fault(instance.function.source, at, message)
    }

    /// Returns the value of a body's last expression.
    fn result(
        &mut self,
        instance: &mut Instance<'_>,
        lines: &mut Lines,
        expression: &Expr,
    ) -> Result<(), Fault> {
        if instance.output == Type::Unit {
            return self.statement(instance, lines, expression);
        }
        let output = instance.output.clone();
        let value = self.value_as(instance, expression, Some(&output))?;
        self.return_value(lines, value);
        Ok(())
    }

    fn return_value(&mut self, lines: &mut Lines, value: Value) {
        match (&value.ty, value.text.strip_prefix("{\n")) {
            (Type::Named(of), Some(fields)) => {
                lines.open(&format!("return ({}){{", self.spelling(of)));
                fields
                    .trim_end_matches('}')
                    .lines()
                    .for_each(|line| lines.add(line));
                lines.close("};");
            }
            _ => lines.add(&format!("return {};", value.text)),
        }
    }

    fn local(
        &mut self,
        instance: &mut Instance<'_>,
        lines: &mut Lines,
        local: &Local,
    ) -> Result<(), Fault> {
        let Some(init) = &local.init else {
            return Err(self.outside(instance, local, "a variable without a value"));
        };
        let (pattern, expected) = match &local.pat {
            Pat::Type(typed) => {
                let (source, owner) = (instance.function.source, instance.owner);
                let ty = self.items.ty(source, &typed.ty, owner)?;
                (typed.pat.as_ref(), Some(self.resolve(&ty, &instance.sizes)))
            }
            other => (other, None),
        };
        if let (Pat::Tuple(pair), Expr::MethodCall(call)) = (pattern, init.expr.as_ref())
            && call.method == "split_at_mut"
            && pair.elems.len() == 2
        {
            let whole = self.value(instance, &call.receiver)?;
            let count = self.value(instance, &call.args[0])?;
            let rest = Value {
                text: format!("{} + {}", whole.text, count.at_least(12)),
                rank: 12,
                ..whole.clone()
            };
            self.bind(instance, lines, &pair.elems[0], whole)?;
            return self.bind(instance, lines, &pair.elems[1], rest);
        }
        let mut value = self.value_as(instance, &init.expr, expected.as_ref())?;
        if let Some(ty) = expected {
            value.ty = ty;
        }
        self.bind(instance, lines, pattern, value)
    }

    /// Declares a variable with a value; one of the same block and type that has the name is assigned to.
    fn bind(
        &mut self,
        instance: &mut Instance<'_>,
        lines: &mut Lines,
        pattern: &Pat,
        value: Value,
    ) -> Result<(), Fault> {
        let Pat::Ident(pattern) = pattern else {
            return Err(self.outside(instance, pattern, "a pattern"));
        };
        let name = pattern.ident.to_string();
        let known = instance.scopes.last().expect("a block is open").get(&name);
        let known = known.or(if instance.scopes.len() == 2 {
            instance.scopes[0].get(&name)
        } else {
            None
        });
        match known {
            Some(ty) if matches!(ty, Type::Ref(..)) && *ty.referent() == *value.ty.referent() => {
                if value.text != name {
                    lines.add(&format!("{name} = {};", value.text));
                }
                return Ok(());
            }
            None if instance.variable(&name).is_none() => {}
            _ => return Err(self.outside(instance, pattern, "a second variable of a name")),
        }
        let ty = match &value.ty {
            Type::Unit => return Err(self.outside(instance, pattern, "a variable of no value")),
            ty => ty.clone(),
        };
        let is_fixed = pattern.mutability.is_none() && ty.is_scalar();
        let start = if is_fixed { "const " } else { "" };
        let declared = ty.declare(&name, &|of| self.spelling(of));
        match (&ty, value.text.strip_prefix("{\n")) {
            (Type::Array(_, length), _) => {
                self.declare_array(lines, &declared, &name, length, &value)
            }
            (_, Some(fields)) => {
                lines.open(&format!("{start}{declared} = {{"));
                fields
                    .trim_end_matches('}')
                    .lines()
                    .for_each(|line| lines.add(line));
                lines.close("};");
            }
            _ => lines.add(&format!("{start}{declared} = {};", value.text)),
        }
        let scope = instance.scopes.last_mut().expect("a block is open");
        scope.insert(name, ty);
        Ok(())
    }

    fn declare_array(
        &self,
        lines: &mut Lines,
        declared: &str,
        name: &str,
        length: &str,
        value: &Value,
    ) {
        match &value.repeated {
            Some(element) if element == "0" => lines.add(&format!("{declared} = {};", value.text)),
            None if value.text.starts_with('{') => {
                lines.add(&format!("{declared} = {};", value.text))
            }
            Some(element) => {
                lines.add(&format!("{declared};"));
                lines.open(&format!("for (int i = 0; i < {length}; ++i) {{"));
                lines.add(&format!("{name}[i] = {element};"));
                lines.close("}");
            }
            None => {
                lines.add(&format!("{declared};"));
                lines.add(&format!("memcpy({name}, {}, sizeof {name});", value.text));
            }
        }
    }

    fn statement(
        &mut self,
        instance: &mut Instance<'_>,
        lines: &mut Lines,
        expression: &Expr,
    ) -> Result<(), Fault> {
        match expression {
            Expr::If(branch) => {
                let condition = self.value(instance, &branch.cond)?;
                lines.open(&format!("if ({}) {{", condition.text));
                self.branches(instance, lines, branch)
            }
            Expr::While(turns) => {
                let condition = self.value(instance, &turns.cond)?;
                lines.open(&format!("while ({}) {{", condition.text));
                self.block(instance, lines, &turns.body, false)?;
                lines.close("}");
                Ok(())
            }
            Expr::Loop(turns) if turns.label.is_none() => {
                lines.open("for (;;) {");
                self.block(instance, lines, &turns.body, false)?;
                lines.close("}");
                Ok(())
            }
            Expr::ForLoop(turns) if turns.label.is_none() => self.for_loop(instance, lines, turns),
            Expr::Break(end) if end.label.is_none() && end.expr.is_none() => {
                lines.add("break;");
                Ok(())
            }
            Expr::Continue(next) if next.label.is_none() => {
                lines.add("continue;");
                Ok(())
            }
            Expr::Return(returned) => {
                match &returned.expr {
                    Some(expression) => {
                        let output = instance.output.clone();
                        let value = self.value_as(instance, expression, Some(&output))?;
                        self.return_value(lines, value);
                    }
                    None => lines.add("return;"),
                }
                Ok(())
            }
            Expr::Assign(assign) => self.assign(instance, lines, assign),
            Expr::Const(checked) => self.check(instance, lines, checked),
            Expr::Binary(_) | Expr::Call(_) | Expr::MethodCall(_) => {
                let value = self.value(instance, expression)?;
                lines.add(&format!("{};", value.text));
                Ok(())
            }
            other => Err(self.outside(instance, other, "this statement")),
        }
    }

    /// The branches of an `if` whose condition is written.
    fn branches(
        &mut self,
        instance: &mut Instance<'_>,
        lines: &mut Lines,
        branch: &syn::ExprIf,
    ) -> Result<(), Fault> {
        self.block(instance, lines, &branch.then_branch, false)?;
        match branch.else_branch.as_ref().map(|(_, other)| other.as_ref()) {
            None => {
                lines.close("}");
                Ok(())
            }
            Some(Expr::If(next)) => {
                let condition = self.value(instance, &next.cond)?;
                lines.depth -= 1;
                lines.open(&format!("}} else if ({}) {{", condition.text));
                self.branches(instance, lines, next)
            }
            Some(Expr::Block(block)) => {
                lines.depth -= 1;
                lines.open("} else {");
                self.block(instance, lines, &block.block, false)?;
                lines.close("}");
                Ok(())
            }
            Some(other) => Err(self.outside(instance, other, "this branch")),
        }
    }

    fn for_loop(
        &mut self,
        instance: &mut Instance<'_>,
        lines: &mut Lines,
        turns: &syn::ExprForLoop,
    ) -> Result<(), Fault> {
        let Pat::Ident(name) = turns.pat.as_ref() else {
            return Err(self.outside(instance, &turns.pat, "a pattern in a loop"));
        };
        let (mut over, mut step, mut is_reversed) = (turns.expr.as_ref(), None, false);
        while let Expr::MethodCall(call) = over {
            match call.method.to_string().as_str() {
                "rev" => is_reversed = true,
                "step_by" => step = Some(self.value(instance, &call.args[0])?),
                _ => return Err(self.outside(instance, over, "a loop over this")),
            }
            over = &call.receiver;
        }
        while let Expr::Paren(inner) = over {
            over = &inner.expr;
        }
        let Expr::Range(range) = over else {
            return Err(self.outside(instance, over, "a loop over anything but a range"));
        };
        let (Some(from), Some(to)) = (&range.start, &range.end) else {
            return Err(self.outside(instance, range, "a loop over an open range"));
        };
        let (from, to) = (self.value(instance, from)?, self.value(instance, to)?);
        let is_closed = matches!(range.limits, syn::RangeLimits::Closed(_));
        let i = name.ident.to_string();
        if instance.variable(&i).is_some() {
            return Err(self.outside(instance, name, "a second variable of a name"));
        }
        let head = match (is_reversed, is_closed, step) {
            (false, _, step) => {
                let less = if is_closed { "<=" } else { "<" };
                let next = step.map_or(format!("++{i}"), |by| format!("{i} += {}", by.text));
                format!(
                    "int {i} = {}; {i} {less} {}; {next}",
                    from.text,
                    to.at_least(11)
                )
            }
            (true, false, None) => {
                let last = to.at_least(12);
                format!("int {i} = {last} - 1; {i} >= {}; --{i}", from.at_least(11))
            }
            _ => return Err(self.outside(instance, range, "a reversed loop in steps")),
        };
        lines.open(&format!("for ({head}) {{"));
        instance.scopes.push(BTreeMap::from([(i, Type::Int)]));
        self.block(instance, lines, &turns.body, false)?;
        instance.scopes.pop();
        lines.close("}");
        Ok(())
    }

    fn assign(
        &mut self,
        instance: &mut Instance<'_>,
        lines: &mut Lines,
        assign: &syn::ExprAssign,
    ) -> Result<(), Fault> {
        let left = self.value(instance, &assign.left)?;
        let right = self.value_as(instance, &assign.right, Some(&left.ty))?;
        let place = left.at_least(16);
        match (&left.ty, &right.repeated) {
            (Type::Array(..), Some(element)) if element == "0" => {
                let size = left.ty.declare("", &|of| self.spelling(of));
                lines.add(&format!(
                    "memset({place}, 0, sizeof({}));",
                    size.replace(" [", "[")
                ));
            }
            (Type::Array(..), None) => {
                let size = left.ty.declare("", &|of| self.spelling(of));
                let size = size.replace(" [", "[");
                lines.add(&format!("memcpy({place}, {}, sizeof({size}));", right.text));
            }
            (Type::Array(..), Some(_)) => {
                return Err(self.outside(instance, assign, "assigning repeated numbers"));
            }
            _ => lines.add(&format!("{} = {};", left.text, right.text)),
        }
        Ok(())
    }

    /// `const { assert!(condition) }`, an array of negative length where it is false.
    fn check(
        &mut self,
        instance: &mut Instance<'_>,
        lines: &mut Lines,
        checked: &syn::ExprConst,
    ) -> Result<(), Fault> {
        if let [Stmt::Expr(Expr::Macro(assertion), None)] = checked.block.stmts.as_slice()
            && assertion.mac.path.is_ident("assert")
            && let Ok(condition) = assertion.mac.parse_body::<Expr>()
        {
            let condition = self.value(instance, &condition)?;
            lines.add(&format!(
                "(void)sizeof(char[{} ? 1 : -1]);",
                condition.at_least(11)
            ));
            return Ok(());
        }
        Err(self.outside(instance, checked, "a constant block that is no assertion"))
    }
}
