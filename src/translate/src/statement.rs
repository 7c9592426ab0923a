//! Statements.

use syn::{Local, Stmt};

use super::*;

#[derive(Default)]
pub(crate) struct Lines {
    pub(crate) text: String,
    depth: usize,
}

impl Lines {
    pub(crate) fn add(&mut self, line: &str) {
        self.text += &format!("{}{line}\n", "    ".repeat(self.depth));
    }

    pub(crate) fn open(&mut self, line: &str) {
        self.add(line);
        self.depth += 1;
    }

    pub(crate) fn close(&mut self, line: &str) {
        self.depth -= 1;
        self.add(line);
    }
}

impl Writer<'_> {
    /// The statements of a block; the value of its last expression is returned if it is a body.
    pub(crate) fn block(
        &mut self,
        here: &mut Instance<'_>,
        block: &Block,
        is_body: bool,
    ) -> Found<()> {
        here.scopes.push(BTreeMap::new());
        let count = block.stmts.len();
        for (number, statement) in block.stmts.iter().enumerate() {
            let above = (self.items).comments_above(here.function.source, statement);
            for line in comment(&above, "").lines() {
                here.lines.add(line.trim_end());
            }
            match statement {
                Stmt::Local(local) => self.local(here, local)?,
                Stmt::Expr(expression, None) if is_body && number + 1 == count => {
                    self.result(here, expression)?;
                }
                Stmt::Expr(expression, _) => self.statement(here, expression)?,
                other => return Err(self.outside(here, other, "an item or macro")),
            }
        }
        here.scopes.pop();
        Ok(())
    }

    pub(crate) fn outside(&self, here: &Instance<'_>, at: &impl Spanned, what: &str) -> Fault {
        let message = format!("{what} is outside the subset that is translated");
        self.items.fault(here.function.source, at, message)
    }

    fn result(&mut self, here: &mut Instance<'_>, expression: &Expr) -> Found<()> {
        if here.output == Type::Unit {
            return self.statement(here, expression);
        }
        self.return_value(here, expression)
    }

    fn return_value(&mut self, here: &mut Instance<'_>, expression: &Expr) -> Found<()> {
        let output = here.output.clone();
        let value = self.value_as(here, expression, Some(&output))?;
        let cast = match &value.ty {
            Type::Named(of) if value.text.starts_with('{') => format!("({})", self.spelling(of)),
            _ => String::new(),
        };
        here.lines.add(&format!("return {cast}{};", value.text));
        Ok(())
    }

    fn local(&mut self, here: &mut Instance<'_>, local: &Local) -> Found<()> {
        let Some(init) = &local.init else {
            return Err(self.outside(here, local, "a variable without a value"));
        };
        let (pattern, expected) = match &local.pat {
            Pat::Type(typed) => {
                let (source, owner) = (here.function.source, here.owner);
                let ty = self.items.ty(source, &typed.ty, owner)?;
                (typed.pat.as_ref(), Some(self.resolve(&ty, &here.sizes)))
            }
            other => (other, None),
        };
        if let (Pat::Tuple(pair), Expr::MethodCall(call)) = (pattern, init.expr.as_ref())
            && call.method == "split_at_mut"
            && pair.elems.len() == 2
        {
            let whole = self.value(here, &call.receiver)?;
            let count = self.value(here, &call.args[0])?;
            let rest = format!("{} + {}", whole.text, count.at_least(12));
            let rest = Value::new(rest, whole.ty.clone(), 12);
            self.bind(here, &pair.elems[0], whole)?;
            return self.bind(here, &pair.elems[1], rest);
        }
        let mut value = self.value_as(here, &init.expr, expected.as_ref())?;
        if let Some(ty) = expected {
            value.ty = ty;
        }
        self.bind(here, pattern, value)
    }

    /// Declares a variable with a value; one of the same block and type that has the name is assigned to.
    fn bind(&mut self, here: &mut Instance<'_>, pattern: &Pat, value: Value) -> Found<()> {
        let Pat::Ident(pattern) = pattern else {
            return Err(self.outside(here, pattern, "a pattern"));
        };
        let name = pattern.ident.to_string();
        let known = here.scopes.last().expect("a block is open").get(&name);
        let parameter = (here.scopes[0].get(&name)).filter(|_| here.scopes.len() == 2);
        match known.or(parameter) {
            Some(ty) if matches!(ty, Type::Ref(..)) && *ty.referent() == *value.ty.referent() => {
                if value.text != name {
                    here.lines.add(&format!("{name} = {};", value.text));
                }
                return Ok(());
            }
            None if here.variable(&name).is_none() => {}
            _ => return Err(self.outside(here, pattern, "a second variable of a name")),
        }
        let ty = match &value.ty {
            Type::Unit => return Err(self.outside(here, pattern, "a variable of no value")),
            ty => ty.clone(),
        };
        let is_fixed = pattern.mutability.is_none() && ty.is_scalar();
        let start = if is_fixed { "const " } else { "" };
        let declared = ty.declare(&name, &|of| self.spelling(of));
        match &ty {
            Type::Array(_, length) => self.declare_array(here, &declared, &name, length, &value),
            _ => (here.lines).add(&format!("{start}{declared} = {};", value.text)),
        }
        let scope = here.scopes.last_mut().expect("a block is open");
        scope.insert(name, ty);
        Ok(())
    }

    fn declare_array(
        &self,
        here: &mut Instance<'_>,
        declared: &str,
        name: &str,
        length: &str,
        value: &Value,
    ) {
        let (lines, text) = (&mut here.lines, &value.text);
        match &value.repeated {
            Some(element) if element != "0" => {
                lines.add(&format!("{declared};"));
                lines.open(&format!("for (int i = 0; i < {length}; ++i) {{"));
                lines.add(&format!("{name}[i] = {element};"));
                lines.close("}");
            }
            None if !text.starts_with('{') => {
                lines.add(&format!("{declared};"));
                lines.add(&format!("memcpy({name}, {text}, sizeof {name});"));
            }
            _ => lines.add(&format!("{declared} = {text};")),
        }
    }

    fn statement(&mut self, here: &mut Instance<'_>, expression: &Expr) -> Found<()> {
        match expression {
            Expr::If(branch) => {
                let condition = self.value(here, &branch.cond)?;
                here.lines.open(&format!("if ({}) {{", condition.text));
                self.branches(here, branch)?;
            }
            Expr::While(turns) => {
                let condition = self.value(here, &turns.cond)?;
                self.turns(here, &format!("while ({})", condition.text), &turns.body)?;
            }
            Expr::Loop(turns) if turns.label.is_none() => {
                self.turns(here, "for (;;)", &turns.body)?;
            }
            Expr::ForLoop(turns) if turns.label.is_none() => self.for_loop(here, turns)?,
            Expr::Break(end) if end.label.is_none() && end.expr.is_none() => {
                here.lines.add("break;");
            }
            Expr::Continue(next) if next.label.is_none() => here.lines.add("continue;"),
            Expr::Return(returned) => match &returned.expr {
                Some(expression) => self.return_value(here, expression)?,
                None => here.lines.add("return;"),
            },
            Expr::Assign(assign) => self.assign(here, assign)?,
            Expr::Binary(_) | Expr::Call(_) | Expr::MethodCall(_) => {
                let value = self.value(here, expression)?;
                here.lines.add(&format!("{};", value.text));
            }
            other => return Err(self.outside(here, other, "this statement")),
        }
        Ok(())
    }

    /// The branches of an `if` whose condition is written.
    fn branches(&mut self, here: &mut Instance<'_>, branch: &syn::ExprIf) -> Found<()> {
        self.block(here, &branch.then_branch, false)?;
        match branch.else_branch.as_ref().map(|(_, other)| other.as_ref()) {
            None => here.lines.close("}"),
            Some(Expr::If(next)) => {
                let condition = self.value(here, &next.cond)?.text;
                here.lines.depth -= 1;
                here.lines.open(&format!("}} else if ({condition}) {{"));
                self.branches(here, next)?;
            }
            Some(Expr::Block(block)) => {
                here.lines.depth -= 1;
                here.lines.open("} else {");
                self.block(here, &block.block, false)?;
                here.lines.close("}");
            }
            Some(other) => return Err(self.outside(here, other, "this branch")),
        }
        Ok(())
    }

    fn for_loop(&mut self, here: &mut Instance<'_>, turns: &syn::ExprForLoop) -> Found<()> {
        let Pat::Ident(name) = turns.pat.as_ref() else {
            return Err(self.outside(here, &turns.pat, "a pattern in a loop"));
        };
        let (mut over, mut step, mut is_reversed) = (turns.expr.as_ref(), None, false);
        while let Expr::MethodCall(call) = over {
            match call.method.to_string().as_str() {
                "rev" => is_reversed = true,
                "step_by" => step = Some(self.value(here, &call.args[0])?),
                _ => return Err(self.outside(here, over, "a loop over this")),
            }
            over = &call.receiver;
        }
        while let Expr::Paren(inner) = over {
            over = &inner.expr;
        }
        let Expr::Range(range) = over else {
            return Err(self.outside(here, over, "a loop over anything but a range"));
        };
        let (Some(from), Some(to)) = (&range.start, &range.end) else {
            return Err(self.outside(here, range, "a loop over an open range"));
        };
        let (from, to) = (self.value(here, from)?, self.value(here, to)?);
        let is_closed = matches!(range.limits, syn::RangeLimits::Closed(_));
        let i = name.ident.to_string();
        if here.variable(&i).is_some() {
            return Err(self.outside(here, name, "a second variable of a name"));
        }
        let head = match (is_reversed, is_closed, step) {
            (false, _, step) => {
                let less = if is_closed { "<=" } else { "<" };
                let next = step.map_or(format!("++{i}"), |by| format!("{i} += {}", by.text));
                let (from, to) = (from.text, to.at_least(11));
                format!("int {i} = {from}; {i} {less} {to}; {next}")
            }
            (true, false, None) => {
                let last = to.at_least(12);
                format!("int {i} = {last} - 1; {i} >= {}; --{i}", from.at_least(11))
            }
            _ => return Err(self.outside(here, range, "a reversed loop in steps")),
        };
        here.scopes.push(BTreeMap::from([(i, Type::Int)]));
        self.turns(here, &format!("for ({head})"), &turns.body)?;
        here.scopes.pop();
        Ok(())
    }

    fn turns(&mut self, here: &mut Instance<'_>, head: &str, body: &Block) -> Found<()> {
        here.lines.open(&format!("{head} {{"));
        self.block(here, body, false)?;
        here.lines.close("}");
        Ok(())
    }

    fn assign(&mut self, here: &mut Instance<'_>, assign: &syn::ExprAssign) -> Found<()> {
        let left = self.value(here, &assign.left)?;
        let right = self.value_as(here, &assign.right, Some(&left.ty))?;
        let place = left.at_least(16);
        let size = left.ty.declare("", &|of| self.spelling(of));
        let size = size.replace(" [", "[");
        let text = right.text;
        let line = match (&left.ty, right.repeated.as_deref()) {
            (Type::Array(..), Some("0")) => format!("memset({place}, 0, sizeof({size}));"),
            (Type::Array(..), None) => format!("memcpy({place}, {text}, sizeof({size}));"),
            (Type::Array(..), Some(_)) => {
                return Err(self.outside(here, assign, "assigning repeated numbers"));
            }
            _ => format!("{} = {text};", left.text),
        };
        here.lines.add(&line);
        Ok(())
    }
}
