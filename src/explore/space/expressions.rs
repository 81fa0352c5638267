//! Expressions over a candidate's parameters, free variables and costs.
//!
//! ```text
//! "max(16, icu.depth)" --evalexpr--> tree --names, functions checked--> Expression   values of all names --> value
//! ```
//! Numbers are real: 1 / 2 is 0.5, 4 == 4.0; who needs a whole number rounds. Functions: [`FUNCTIONS`] alone.

use std::collections::BTreeMap;
use std::ops::Range;

use evalexpr::{Context, EvalexprError, EvalexprResult, Node, Operator, Value as Eval};
use toml::Spanned;

use super::super::metric::{METRICS, Needs};
use super::super::value::Value;
use super::faults::{Fault, unknown};
use crate::scene::toml::faults::suggest;
use crate::scene::toml::source::Source;

/// What an expression may call.
const FUNCTIONS: [&str; 13] = [
    "min",
    "max",
    "if",
    "ceil",
    "floor",
    "round",
    "math::abs",
    "math::sqrt",
    "math::pow",
    "math::exp",
    "math::ln",
    "math::log2",
    "math::log10",
];

/// Longest expression (bytes).
const MAX_BYTES: usize = 1000;

/// An expression whose names all mean something.
#[derive(Clone, Debug)]
pub(super) struct Expression {
    /// As typed.
    pub(super) text: String,
    /// Where it stands.
    pub(super) at: Range<usize>,
    tree: Node,
}

/// The names of a space: each has a slot.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    slots: BTreeMap<String, usize>,
}

impl Names {
    /// The slot of a new name, or of a known one.
    pub(super) fn add(&mut self, name: &str) -> usize {
        let next = self.slots.len();
        *self.slots.entry(name.to_owned()).or_insert(next)
    }

    /// The slot of a name.
    pub(super) fn slot(&self, name: &str) -> Option<usize> {
        self.slots.get(name).copied()
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.slots.len()
    }
}

/// Values of all names of a candidate; what is not known yet is empty.
#[derive(Clone, Debug)]
pub(super) struct Frame<'n> {
    names: &'n Names,
    values: Vec<Eval>,
}

impl<'n> Frame<'n> {
    /// Nothing is known.
    pub(super) fn new(names: &'n Names) -> Frame<'n> {
        Frame { names, values: vec![Eval::Empty; names.len()] }
    }

    /// Sets the value of a slot.
    pub(super) fn set(&mut self, slot: usize, value: &Value) {
        self.values[slot] = match value {
            Value::Bool(b) => Eval::Boolean(*b),
            Value::Integer(n) => Eval::Float(*n as f64),
            Value::Float(x) => Eval::Float(*x),
            Value::Text(text) => Eval::String(text.clone()),
        };
    }

    /// All values, to start another frame with.
    pub(super) fn into_values(self) -> Vec<Eval> {
        self.values
    }

    /// A frame that starts with these values.
    pub(super) fn with(names: &'n Names, values: Vec<Eval>) -> Frame<'n> {
        Frame { names, values }
    }
}

impl Context for Frame<'_> {
    fn get_value(&self, identifier: &str) -> Option<&Eval> {
        self.values.get(self.names.slot(identifier)?).filter(|v| !v.is_empty())
    }

    fn call_function(&self, identifier: &str, argument: &Eval) -> EvalexprResult<Eval> {
        call(identifier, argument)
    }

    fn are_builtin_functions_disabled(&self) -> bool {
        true
    }

    fn set_builtin_functions_disabled(&mut self, disabled: bool) -> EvalexprResult<()> {
        if disabled { Ok(()) } else { Err(EvalexprError::BuiltinFunctionsCannotBeEnabled) }
    }
}

fn call(name: &str, argument: &Eval) -> EvalexprResult<Eval> {
    let one = |f: fn(f64) -> f64| Ok(Eval::Float(f(argument.as_number()?)));
    let many = |f: fn(f64, f64) -> f64| {
        let numbers = argument.as_tuple()?;
        let mut rest = numbers.iter().map(Eval::as_number);
        let first = rest.next().ok_or_else(|| EvalexprError::wrong_function_argument_amount(0, 2))??;
        rest.try_fold(first, |a, b| Ok(f(a, b?))).map(Eval::Float)
    };
    match name {
        "min" => many(f64::min),
        "max" => many(f64::max),
        "if" => {
            let mut parts = argument.as_fixed_len_tuple(3)?;
            let which = if parts[0].as_boolean()? { 1 } else { 2 };
            Ok(parts.swap_remove(which))
        }
        "ceil" => one(f64::ceil),
        "floor" => one(f64::floor),
        "round" => one(f64::round),
        "math::abs" => one(f64::abs),
        "math::sqrt" => one(f64::sqrt),
        "math::pow" => {
            let pair = argument.as_fixed_len_tuple(2)?;
            Ok(Eval::Float(pair[0].as_number()?.powf(pair[1].as_number()?)))
        }
        "math::exp" => one(f64::exp),
        "math::ln" => one(f64::ln),
        "math::log2" => one(f64::log2),
        "math::log10" => one(f64::log10),
        other => Err(EvalexprError::FunctionIdentifierNotFound(other.to_owned())),
    }
}

impl Expression {
    /// Parses an expression; its names are looked up later, by [`Expression::check_names`].
    pub(super) fn parse(source: &Source<'_>, text: &Spanned<String>) -> Result<Expression, Fault> {
        let at = text.span();
        let text = text.get_ref();
        let fault = |what: String| source.fault(at.clone(), format!("{text:?}: {what}"));
        if text.len() > MAX_BYTES {
            return Err(source.fault(at, format!("an expression of over {MAX_BYTES} characters")));
        }
        if text.trim().is_empty() {
            return Err(fault("an expression was expected".to_owned()));
        }
        let mut tree = evalexpr::build_operator_tree(text).map_err(|e| fault(plain(&e)))?;
        for operator in tree.iter_operators_mut() {
            use Operator::{
                AddAssign, AndAssign, Assign, Chain, Const, DivAssign, ExpAssign, ModAssign, MulAssign,
                OrAssign, SubAssign,
            };
            match operator {
                Assign => {
                    return Err(fault("`=` would set a value".to_owned()).with_help("write == to compare"));
                }
                AddAssign | SubAssign | MulAssign | DivAssign | ModAssign | ExpAssign | AndAssign
                | OrAssign | Chain => {
                    return Err(fault("expected one expression that sets nothing".to_owned()));
                }
                Const { value } => {
                    if let Eval::Int(n) = value {
                        *value = Eval::Float(*n as f64);
                    }
                }
                _ => {}
            }
        }
        if let Some(name) = tree.iter_function_identifiers().find(|n| !FUNCTIONS.contains(n)) {
            return Err(unknown(source, place(source, &at, name), "function", name, FUNCTIONS));
        }
        Ok(Expression { text: text.clone(), at, tree })
    }

    /// The names that it mentions.
    pub(super) fn mentions(&self) -> impl Iterator<Item = &str> {
        self.tree.iter_variable_identifiers()
    }

    /// Whether all of its names are among `names`.
    pub(super) fn check_names(&self, source: &Source<'_>, names: &Names) -> Result<(), Fault> {
        let Some(name) = self.mentions().find(|n| names.slot(n).is_none()) else { return Ok(()) };
        let at = place(source, &self.at, name);
        if METRICS.iter().any(|m| m.name == name) {
            let costs: Vec<_> = METRICS.iter().filter(|m| m.needs == Needs::Cost).map(|m| m.name).collect();
            let what = format!(
                "{name} is not known before a run, or not in this technology; of the costs there are {}",
                costs.join(", ")
            );
            return Err(source.fault(at, what));
        }
        let fault = source.fault(at, format!("{:?}: unknown name {name:?}", self.text));
        Err(suggest(fault, name, names.slots.keys().map(String::as_str)))
    }

    /// Its value.
    ///
    /// # Errors
    /// What cannot be reckoned.
    pub(super) fn value(&self, frame: &Frame<'_>) -> Result<Value, String> {
        match self.tree.eval_with_context(frame).map_err(|e| plain(&e))? {
            Eval::Float(x) => Ok(Value::Float(x)),
            Eval::Int(n) => Ok(Value::Integer(n)),
            Eval::Boolean(b) => Ok(Value::Bool(b)),
            Eval::String(text) => Ok(Value::Text(text)),
            Eval::Tuple(_) => Err("several values, expected one".to_owned()),
            Eval::Empty => Err("no value".to_owned()),
        }
    }
}

/// Where `name` stands in an expression.
fn place(source: &Source<'_>, at: &Range<usize>, name: &str) -> Range<usize> {
    let is_part = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || "_.:".contains(c));
    let text = source.slice(at);
    text.match_indices(name)
        .find(|(i, _)| {
            !is_part(text[..*i].chars().next_back()) && !is_part(text[i + name.len()..].chars().next())
        })
        .map_or(at.clone(), |(i, _)| at.start + i..at.start + i + name.len())
}

/// The library's message in the words of the file.
fn plain(error: &EvalexprError) -> String {
    use EvalexprError as E;
    let value = |v: &Eval| match v {
        Eval::String(text) => format!("the word {text:?}"),
        Eval::Boolean(b) => format!("{b}"),
        Eval::Float(x) => format!("the number {x}"),
        Eval::Int(n) => format!("the number {n}"),
        Eval::Tuple(parts) => format!("{} values", parts.len()),
        Eval::Empty => "nothing".to_owned(),
    };
    match error {
        E::UnmatchedLBrace => "a parenthesis is not closed".to_owned(),
        E::UnmatchedRBrace => "a parenthesis is closed that was not opened".to_owned(),
        E::UnmatchedDoubleQuote => "a quote is not closed".to_owned(),
        E::WrongOperatorArgumentAmount { .. } => "an operator lacks a value".to_owned(),
        E::WrongFunctionArgumentAmount { expected, actual } => {
            format!("a function of {} values has {actual}", expected.start())
        }
        E::AppendedToLeafNode | E::PrecedenceViolation | E::MissingOperatorOutsideOfBrace => {
            "an operator is missing between two values".to_owned()
        }
        E::ExpectedNumber { actual } | E::ExpectedNumberOrString { actual } => {
            format!("{} where a number is expected", value(actual))
        }
        E::ExpectedBoolean { actual } => format!("{} where true or false is expected", value(actual)),
        E::ExpectedTuple { actual } => format!("{} where two or more values are expected", value(actual)),
        E::ExpectedFixedLengthTuple { expected_length, actual } => {
            format!("{} where {expected_length} are expected", value(actual))
        }
        E::WrongTypeCombination { .. } => "numbers and words do not mix here".to_owned(),
        E::UnmatchedPartialToken { first, .. } => format!("a single {first}"),
        E::VariableIdentifierNotFound(name) => format!("{name} is not known here"),
        other => {
            let message = other.to_string();
            message.trim_end_matches('.').to_owned()
        }
    }
}
