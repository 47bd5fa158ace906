//! Random draws: any value of a recipe may be a distribution, and each scene turns the tree into plain TOML.
//!
//! A draw is keyed by (seed, scene, path of the key), so it is the same in whatever order scenes are drawn,
//! and a key that is added elsewhere changes nothing.

use catseye::base::error::{Error, Result, nearest};
use catseye::base::rng::philox4x32_10;
use catseye::scene::toml_file::Document;
use sha2::{Digest, Sha256};
use statrs::distribution::{ContinuousCDF, Normal};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Largest number of copies of a table that `repeat` may ask for.
pub const MAX_REPEAT: i64 = 10_000;
/// Largest integer that every number format holds.
const MAX_INTEGER: f64 = 9_007_199_254_740_992.0;
const KINDS: [&str; 6] = ["uniform", "log_uniform", "normal", "integer", "choice", "draw"];
const PRESENT: &str = "chance";
const COPIES: &str = "repeat";

/// A value of the recipe with its place in the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    value: Value,
    span: Range<usize>,
}

#[derive(Debug, Clone, PartialEq)]
enum Value {
    Plain(toml::Value),
    Table(Table),
    Array(Vec<Node>),
    Drawn(Box<Distribution>),
}

#[derive(Debug, Clone, PartialEq)]
struct Table {
    entries: Vec<(String, Node)>,
    /// Probability that the table is present.
    chance: Option<Box<Node>>,
    /// Number of times that it stands in its array.
    repeat: Option<Box<Node>>,
}

#[derive(Debug, Clone, PartialEq)]
enum Distribution {
    Numbers { kind: Kind, of: [Node; 2], limits: Option<[Node; 2]> },
    Choice { values: Vec<Node>, weights: Option<Vec<f64>> },
    Named { name: String, times: Option<Node>, plus: Option<Node> },
}

/// Distributions of numbers, each given by two parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Uniform,
    LogUniform,
    Normal,
    Integer,
}

impl Distribution {
    fn parts(&self) -> Vec<&Node> {
        match self {
            Distribution::Numbers { of, limits, .. } => of.iter().chain(limits.iter().flatten()).collect(),
            Distribution::Choice { values, .. } => values.iter().collect(),
            Distribution::Named { times, plus, .. } => times.iter().chain(plus).collect(),
        }
    }
}

impl Node {
    /// The keys of a table with their values; none for anything else.
    pub fn keys(&self) -> impl Iterator<Item = (&str, &Node)> {
        let entries = match &self.value {
            Value::Table(t) => t.entries.as_slice(),
            _ => &[],
        };
        entries.iter().map(|(k, n)| (k.as_str(), n))
    }

    /// The value under a key of a table.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.keys().find(|(k, _)| *k == key).map(|(_, n)| n)
    }

    /// Range of bytes in the file.
    pub fn span(&self) -> &Range<usize> {
        &self.span
    }

    /// The plain texts in the value, with all that could be chosen.
    pub fn texts(&self) -> BTreeSet<String> {
        let mut texts = BTreeSet::new();
        self.visit(&mut |n| {
            if let Value::Plain(toml::Value::String(s)) = &n.value {
                texts.insert(s.clone());
            }
        });
        texts
    }

    /// Whether the value depends on the scene.
    pub fn is_drawn(&self) -> bool {
        let mut found = false;
        self.visit(&mut |n| {
            found |= match &n.value {
                Value::Drawn(_) => true,
                Value::Table(t) => t.chance.is_some() || t.repeat.is_some(),
                _ => false,
            }
        });
        found
    }

    fn visit(&self, f: &mut dyn FnMut(&Node)) {
        f(self);
        match &self.value {
            Value::Plain(_) => {}
            Value::Table(t) => {
                t.entries.iter().for_each(|(_, n)| n.visit(f));
                t.chance.iter().chain(&t.repeat).for_each(|n| n.visit(f));
            }
            Value::Array(a) => a.iter().for_each(|n| n.visit(f)),
            Value::Drawn(d) => d.parts().into_iter().for_each(|n| n.visit(f)),
        }
    }
}

/// A TOML text of values and distributions, checked as far as no scene is needed.
#[derive(Debug, Clone)]
pub struct Tree {
    file: PathBuf,
    text: String,
    top: Vec<(String, Node)>,
    /// The entries of the table `draw`, which several places may share.
    named: BTreeMap<String, Node>,
}

impl Tree {
    /// Parses a text whose values may be distributions.
    ///
    /// # Errors
    /// Returns an error for text that is not TOML, a distribution with unknown keys, reversed bounds or
    /// weights that do not match, and a draw that names nothing or itself.
    pub fn parse(file: &Path, text: &str) -> Result<Tree> {
        let doc = Document::parse(file, text)?;
        let tree = DeTable::parse(text)
            .map_err(|e| Error::Failed(format!("{}: {}", file.display(), e.message())))?
            .into_inner();
        let reader = Reader { doc: &doc };
        let top = reader.entries(&tree)?;
        let named: BTreeMap<String, Node> = top
            .iter()
            .filter(|(k, _)| k == "draw")
            .flat_map(|(_, n)| n.keys().map(|(k, n)| (k.to_string(), n.clone())))
            .collect();
        let tree = Tree { file: file.to_path_buf(), text: text.to_string(), top, named };
        for (_, node) in &tree.top {
            tree.check_names(&doc, node)?;
        }
        for name in tree.named.keys() {
            tree.check_cycle(&doc, name, &mut Vec::new())?;
        }
        Ok(tree)
    }

    /// The value of a key at the top level.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.top.iter().find(|(k, _)| k == key).map(|(_, n)| n)
    }

    /// The text as read.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The file from which it was read.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// The parsed text with the positions of its keys, for error messages.
    ///
    /// # Errors
    /// Returns an error if the text is not TOML.
    pub fn document(&self) -> Result<Document<'_>> {
        Document::parse(&self.file, &self.text)
    }

    fn check_names(&self, doc: &Document<'_>, node: &Node) -> Result<()> {
        let mut wrong = None;
        node.visit(&mut |n| {
            if let Value::Drawn(d) = &n.value
                && let Distribution::Named { name, .. } = &**d
                && !self.named.contains_key(name)
            {
                wrong.get_or_insert((n.span.clone(), name.clone()));
            }
        });
        let Some((span, name)) = wrong else { return Ok(()) };
        let known: Vec<&str> = self.named.keys().map(String::as_str).collect();
        let b = doc.bad(&span, format!("there is no draw '{name}'"));
        let b = if known.is_empty() { b } else { b.allowed(known.join(", ")) };
        Err(match nearest(&name, known) {
            Some(n) => b.remedy(format!("did you mean '{n}'?")),
            None => b.remedy(format!("give [draw] {name} = a distribution")),
        }
        .into())
    }

    fn check_cycle(&self, doc: &Document<'_>, name: &str, above: &mut Vec<String>) -> Result<()> {
        let Some(node) = self.named.get(name) else { return Ok(()) };
        if let Some(first) = above.iter().position(|n| n == name) {
            let mut round = above[first..].to_vec();
            round.push(name.to_string());
            let b = doc.bad(&node.span, format!("the draw depends on itself: {}", round.join(" -> ")));
            return Err(b.remedy("define one of them without the others").into());
        }
        let mut needs = Vec::new();
        node.visit(&mut |n| {
            if let Value::Drawn(d) = &n.value
                && let Distribution::Named { name, .. } = &**d
            {
                needs.push(name.clone());
            }
        });
        above.push(name.to_string());
        for n in needs {
            self.check_cycle(doc, &n, above)?;
        }
        above.pop();
        Ok(())
    }
}

/// Converts a parsed file to nodes.
struct Reader<'a> {
    doc: &'a Document<'a>,
}

impl Reader<'_> {
    fn entries(&self, table: &DeTable<'_>) -> Result<Vec<(String, Node)>> {
        table.iter().map(|(k, v)| Ok((k.get_ref().to_string(), self.node(v)?))).collect()
    }

    fn node(&self, at: &Spanned<DeValue<'_>>) -> Result<Node> {
        let span = at.span();
        let value = match at.get_ref() {
            DeValue::Table(t) => match self.distribution(t, &span)? {
                Some(d) => Value::Drawn(Box::new(d)),
                None => self.table(t)?,
            },
            DeValue::Array(a) => Value::Array(a.iter().map(|v| self.node(v)).collect::<Result<Vec<Node>>>()?),
            DeValue::String(s) => Value::Plain(toml::Value::String(s.to_string())),
            DeValue::Boolean(b) => Value::Plain(toml::Value::Boolean(*b)),
            DeValue::Integer(i) => match i64::from_str_radix(i.as_str(), i.radix()) {
                Ok(i) => Value::Plain(toml::Value::Integer(i)),
                Err(_) => return Err(self.doc.bad(&span, "is too large for an integer").into()),
            },
            DeValue::Float(f) => match f.as_str().parse::<f64>() {
                Ok(x) => Value::Plain(toml::Value::Float(x)),
                Err(_) => return Err(self.doc.bad(&span, "is not a number").into()),
            },
            DeValue::Datetime(_) => {
                return Err(self.doc.bad(&span, "is a date, which nothing here takes").into());
            }
        };
        Ok(Node { value, span })
    }

    fn table(&self, t: &DeTable<'_>) -> Result<Value> {
        let mut table = Table { entries: Vec::new(), chance: None, repeat: None };
        for (key, node) in self.entries(t)? {
            match key.as_str() {
                PRESENT => {
                    if let Value::Plain(v) = &node.value
                        && !number_of(v).is_some_and(|p| (0.0..=1.0).contains(&p))
                    {
                        return Err(self
                            .doc
                            .bad(&node.span, "is not a probability")
                            .allowed("0..=1")
                            .remedy("give the probability that the table is present")
                            .into());
                    }
                    table.chance = Some(Box::new(node));
                }
                COPIES => table.repeat = Some(Box::new(node)),
                _ => table.entries.push((key, node)),
            }
        }
        Ok(Value::Table(table))
    }

    /// Returns an error for a table of one list whose key is nearly that of a distribution.
    fn misspelt(&self, t: &DeTable<'_>) -> Result<Option<Distribution>> {
        let mut entries = t.iter();
        let (Some((key, value)), None) = (entries.next(), entries.next()) else { return Ok(None) };
        // Names of tables are no shorter; and what is drawn from is a list.
        let long = key.get_ref().len() >= 5 && matches!(value.get_ref(), DeValue::Array(_));
        match nearest(key.get_ref(), KINDS).filter(|_| long) {
            Some(n) => Err(self
                .doc
                .bad(&key.span(), "is not a distribution")
                .allowed(KINDS.join(", "))
                .remedy(format!("did you mean '{n}'?"))
                .into()),
            None => Ok(None),
        }
    }

    /// Reads a table as a distribution if it has the key of one.
    fn distribution(&self, t: &DeTable<'_>, span: &Range<usize>) -> Result<Option<Distribution>> {
        let given: Vec<&str> = KINDS
            .iter()
            .copied()
            .filter(|k| {
                let value = t.iter().find(|(key, _)| key.get_ref() == k).map(|(_, v)| v.get_ref());
                // {draw} of a text is a reference.
                value.is_some_and(|v| *k != "draw" || matches!(v, DeValue::String(_)))
            })
            .collect();
        let [kind] = given[..] else {
            return match given[..] {
                [] => self.misspelt(t),
                _ => Err(self
                    .doc
                    .bad(span, format!("names two distributions: {}", given.join(" and ")))
                    .remedy("keep one")
                    .into()),
            };
        };
        let more: &[&str] = match kind {
            "normal" => &["limits"],
            "choice" => &["weights"],
            "draw" => &["times", "plus"],
            _ => &[],
        };
        let mut parts: BTreeMap<String, Node> = BTreeMap::new();
        for (key, value) in t.iter() {
            let name: &str = key.get_ref();
            if name != kind && !more.contains(&name) {
                let allowed: Vec<&str> = std::iter::once(kind).chain(more.iter().copied()).collect();
                let b = self.doc.bad(&key.span(), format!("is not a key of the distribution {kind}"));
                let b = b.allowed(allowed.join(", "));
                return Err(match nearest(name, allowed) {
                    Some(n) => b.remedy(format!("did you mean '{n}'?")),
                    None => b.remedy("remove it"),
                }
                .into());
            }
            parts.insert(name.to_string(), self.node(value)?);
        }
        let Some(main) = parts.remove(kind) else { return Ok(None) };
        let distribution = match kind {
            "choice" => {
                let span = main.span.clone();
                let Value::Array(values) = main.value else {
                    return Err(self
                        .doc
                        .bad(&span, "is not a list")
                        .remedy("give choice = [a, b, c]")
                        .into());
                };
                let weights = parts.remove("weights").map(|w| self.weights(w, values.len())).transpose()?;
                if values.is_empty() {
                    return Err(self.doc.bad(&span, "the list is empty").into());
                }
                Distribution::Choice { values, weights }
            }
            "draw" => {
                let Value::Plain(toml::Value::String(name)) = main.value else { return Ok(None) };
                Distribution::Named { name, times: parts.remove("times"), plus: parts.remove("plus") }
            }
            _ => {
                let bounds = "[minimum, maximum]";
                let (kind, what, example) = match kind {
                    "uniform" => (Kind::Uniform, bounds, "uniform = [0, 1]"),
                    "log_uniform" => (Kind::LogUniform, bounds, "log_uniform = [1, 100]"),
                    "integer" => (Kind::Integer, bounds, "integer = [0, 6]"),
                    _ => (Kind::Normal, "[mean, standard deviation]", "normal = [30, 5]"),
                };
                let of = self.pair(main, what, example)?;
                let limits = parts.remove("limits");
                let limits = limits.map(|l| self.pair(l, bounds, "limits = [20, 40]")).transpose()?;
                Distribution::Numbers { kind, of, limits }
            }
        };
        // Parameters that do not depend on a scene are checked now.
        let plain = |n: &Node| match &n.value {
            Value::Plain(v) => number_of(v),
            _ => None,
        };
        if !matches!(distribution, Distribution::Choice { .. }) {
            for n in distribution.parts().into_iter().filter(|n| !matches!(n.value, Value::Drawn(_))) {
                finite(self.doc, &n.span, plain(n))?;
            }
        }
        if let Distribution::Numbers { kind, of, limits } = &distribution {
            let both = |[a, b]: &[Node; 2]| Some([plain(a)?, plain(b)?]);
            if let Some(of) = both(of) {
                check(self.doc, span, *kind, of, limits.as_ref().and_then(both))?;
            }
        }
        Ok(Some(distribution))
    }

    fn pair(&self, node: Node, what: &str, example: &str) -> Result<[Node; 2]> {
        let wrong = || {
            self.doc.bad(&node.span, format!("is not {what}")).remedy(format!("write for example {example}"))
        };
        match node.value {
            Value::Array(list) => list.try_into().map_err(|_| wrong().into()),
            _ => Err(wrong().into()),
        }
    }

    fn weights(&self, node: Node, values: usize) -> Result<Vec<f64>> {
        let bad = |problem: String| -> Error {
            self.doc
                .bad(&node.span, problem)
                .remedy("give one weight for each value, at least one over 0")
                .into()
        };
        let Value::Array(list) = &node.value else { return Err(bad("is not a list".into())) };
        if list.len() != values {
            return Err(bad(format!("has {} weights for {values} values", list.len())));
        }
        let number = |n: &Node| match &n.value {
            Value::Plain(v) => number_of(v).filter(|w| *w >= 0.0 && w.is_finite()),
            _ => None,
        };
        let weights: Option<Vec<f64>> = list.iter().map(number).collect();
        match weights {
            Some(w) if w.iter().sum::<f64>() > 0.0 && w.iter().sum::<f64>().is_finite() => Ok(w),
            _ => Err(bad("the weights are not numbers of 0 or more with a positive, finite sum".into())),
        }
    }
}

fn number_of(v: &toml::Value) -> Option<f64> {
    match v {
        toml::Value::Integer(i) => Some(*i as f64),
        toml::Value::Float(x) => Some(*x),
        _ => None,
    }
}

fn finite(doc: &Document<'_>, span: &Range<usize>, x: Option<f64>) -> Result<f64> {
    x.filter(|x| x.is_finite()).ok_or_else(|| {
        doc.bad(span, "is not a finite number").remedy("give finite numbers to the distribution").into()
    })
}

/// Checks the numbers of a distribution, with the limits of a normal one where they are known.
fn check(
    doc: &Document<'_>,
    span: &Range<usize>,
    kind: Kind,
    [a, b]: [f64; 2],
    limits: Option<[f64; 2]>,
) -> Result<()> {
    let ordered = |a: f64, b: f64, name: &str| match a > b {
        true => Err(Error::from(
            doc.bad(span, format!("the first value of {name}, {a}, is greater than the second, {b}"))
                .remedy("give the minimum first"),
        )),
        false => Ok(()),
    };
    match kind {
        Kind::Uniform => ordered(a, b, "uniform"),
        Kind::LogUniform if a <= 0.0 => {
            Err(doc.bad(span, format!("the minimum of log_uniform is {a}")).allowed("more than 0").into())
        }
        Kind::LogUniform => ordered(a, b, "log_uniform"),
        Kind::Integer => match [a, b].into_iter().find(|x| x.fract() != 0.0 || x.abs() > MAX_INTEGER) {
            Some(x) => Err(doc
                .bad(span, format!("{x} is not an integer, or is too large for one"))
                .remedy("give integers, or use uniform")
                .into()),
            None => ordered(a, b, "integer"),
        },
        Kind::Normal if b < 0.0 => {
            Err(doc.bad(span, format!("the standard deviation is {b}")).allowed("0 or more").into())
        }
        Kind::Normal => {
            let Some([least, greatest]) = limits else { return Ok(()) };
            ordered(least, greatest, "limits")?;
            match normal_between(a, b, least, greatest, 0.5) {
                Some(_) => Ok(()),
                None => Err(doc
                    .bad(
                        span,
                        format!(
                            "normal = [{a}, {b}] has practically no values between {least} and {greatest}"
                        ),
                    )
                    .remedy("widen the limits")
                    .into()),
            }
        }
    }
}

/// Quantile `u` of a normal distribution truncated to [a, b]; None when no probability is left.
fn normal_between(mean: f64, std: f64, a: f64, b: f64, u: f64) -> Option<f64> {
    if std == 0.0 {
        return (a..=b).contains(&mean).then_some(mean);
    }
    let n = Normal::new(0.0, 1.0).ok()?;
    let (a, b) = ((a - mean) / std, (b - mean) / std);
    // In the lower tail, where the distribution function keeps its digits.
    let flip = a > 0.0;
    let (lo, hi) = if flip { (-b, -a) } else { (a, b) };
    let (p, q) = (n.cdf(lo), n.cdf(hi));
    let at = p + (q - p) * if flip { 1.0 - u } else { u };
    let x = n.inverse_cdf(at).clamp(lo, hi);
    // Beyond some 37 deviations doubles have no probability left.
    (q > 0.0 && x.is_finite()).then_some(mean + std * if flip { -x } else { x })
}

/// Origin of a value of the plain text.
#[derive(Debug, Clone, PartialEq)]
pub struct Origin {
    /// Range of its bytes in the recipe.
    pub span: Range<usize>,
    /// Whether it was drawn at random.
    pub drawn: bool,
    /// Path of the key in the recipe, with the indices of copies.
    pub id: String,
}

/// Changes that scenes may make to their draws: array elements that are drawn again or left out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes {
    /// Elements that are drawn again, with the index of the draw.
    pub again: BTreeMap<String, u32>,
    /// Elements that are left out.
    pub dropped: BTreeSet<String>,
}

/// The draws of one scene.
pub struct Draws<'a> {
    tree: &'a Tree,
    doc: Document<'a>,
    seed: u64,
    scene: u32,
    changes: Changes,
    attempt: u32,
    shared: BTreeMap<String, toml::Value>,
    origins: BTreeMap<String, Origin>,
}

impl<'a> Draws<'a> {
    /// Prepares the draws of one scene.
    ///
    /// # Errors
    /// Returns an error if the tree's text cannot be parsed.
    pub fn new(tree: &'a Tree, seed: u64, scene: u32, changes: Changes) -> Result<Draws<'a>> {
        Ok(Draws {
            tree,
            doc: tree.document()?,
            seed,
            scene,
            changes,
            attempt: 0,
            shared: BTreeMap::new(),
            origins: BTreeMap::new(),
        })
    }

    /// Draws the plain value of `node`, which stands at `path` of the recipe. None when a chance left it out.
    ///
    /// # Errors
    /// Returns an error for numbers that only this scene makes invalid.
    pub fn plain(&mut self, node: &Node, path: &str) -> Result<Option<toml::Value>> {
        self.entry(node, path, path, false)
    }

    /// Origins of the values, by the paths that [`Document`] gives to keys, below those of [`Draws::plain`].
    pub fn origins(self) -> BTreeMap<String, Origin> {
        self.origins
    }

    /// A word of 64 random bits for `id`.
    pub fn word(&self, id: &str) -> u64 {
        word(self.seed, self.scene, id, self.attempt)
    }

    /// A uniform random number in [0, 1) with 53 bits.
    fn unit(&self, id: &str) -> f64 {
        (self.word(id) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn entry(&mut self, node: &Node, id: &str, out: &str, drawn: bool) -> Result<Option<toml::Value>> {
        self.once(node)?;
        if let Value::Table(t) = &node.value
            && !self.present(t, id)?
        {
            return Ok(None);
        }
        self.value(node, id, out, drawn).map(Some)
    }

    /// Returns an error for `repeat` outside an array.
    fn once(&self, node: &Node) -> Result<()> {
        match &node.value {
            Value::Table(Table { repeat: Some(r), .. }) => Err(self
                .doc
                .bad(&r.span, "repeat outside an array has no effect")
                .remedy("put repeat into a table of an array, as in [[road.road.vehicle]]")
                .into()),
            _ => Ok(()),
        }
    }

    /// Returns an error for `repeat` and `chance` of a value that stands for one of several places.
    fn always(&self, node: &Node) -> Result<()> {
        self.once(node)?;
        match &node.value {
            Value::Table(Table { chance: Some(c), .. }) => Err(self
                .doc
                .bad(&c.span, "a table in a choice or a draw cannot have a chance")
                .remedy("give the chance to the table that holds the choice or draw")
                .into()),
            _ => Ok(()),
        }
    }

    fn present(&mut self, t: &Table, id: &str) -> Result<bool> {
        let Some(chance) = &t.chance else { return Ok(true) };
        let p = self.number(chance, &format!("{id}.{PRESENT}"))?;
        if !(0.0..=1.0).contains(&p) {
            let b = self.doc.bad(&chance.span, format!("was drawn as {p} in scene {}", self.scene));
            return Err(b.allowed("0..=1").into());
        }
        Ok(self.unit(&format!("{id}.{PRESENT}?")) < p)
    }

    fn copies(&mut self, t: &Table, id: &str) -> Result<Option<u32>> {
        let Some(repeat) = &t.repeat else { return Ok(None) };
        let n = self.number(repeat, &format!("{id}.{COPIES}"))?;
        if n.fract() != 0.0 || !(0.0..=MAX_REPEAT as f64).contains(&n) {
            let b = self.doc.bad(&repeat.span, format!("{n} is not a number of copies"));
            return Err(b
                .allowed(format!("0..={MAX_REPEAT}"))
                .remedy("write for example repeat = { integer = [0, 6] }")
                .into());
        }
        Ok(Some(n as u32))
    }

    fn number(&mut self, node: &Node, id: &str) -> Result<f64> {
        // Its place in the plain text does not exist: what it is for stands there.
        let v = self.value(node, id, "", true)?;
        finite(&self.doc, &node.span, number_of(&v))
    }

    fn pair(&mut self, [a, b]: &[Node; 2], id: &str) -> Result<[f64; 2]> {
        Ok([self.number(a, &format!("{id}.0"))?, self.number(b, &format!("{id}.1"))?])
    }

    fn value(&mut self, node: &Node, id: &str, out: &str, drawn: bool) -> Result<toml::Value> {
        let drawn = drawn || matches!(node.value, Value::Drawn(_));
        if !out.is_empty() {
            let origin = Origin { span: node.span.clone(), drawn, id: id.to_string() };
            self.origins.insert(out.to_string(), origin);
        }
        match &node.value {
            Value::Plain(v) => Ok(v.clone()),
            Value::Table(t) => {
                let mut table = toml::Table::new();
                for (key, node) in &t.entries {
                    let below = |at: &str| if at.is_empty() { String::new() } else { format!("{at}.{key}") };
                    if let Some(v) = self.entry(node, &format!("{id}.{key}"), &below(out), drawn)? {
                        table.insert(key.clone(), v);
                    }
                }
                Ok(toml::Value::Table(table))
            }
            Value::Array(a) => {
                let mut list = Vec::with_capacity(a.len());
                for (i, node) in a.iter().enumerate() {
                    self.element(node, &format!("{id}[{i}]"), out, drawn, &mut list)?;
                }
                Ok(toml::Value::Array(list))
            }
            Value::Drawn(d) => self.draw(d, node, id, out),
        }
    }

    /// Draws one element of an array, with its copies.
    fn element(
        &mut self,
        node: &Node,
        id: &str,
        out: &str,
        drawn: bool,
        list: &mut Vec<toml::Value>,
    ) -> Result<()> {
        let copies = match &node.value {
            Value::Table(t) => self.copies(t, id)?,
            _ => None,
        };
        for copy in 0..copies.unwrap_or(1) {
            let id = if copies.is_some() { format!("{id}#{copy}") } else { id.to_string() };
            if self.changes.dropped.contains(&id) {
                continue;
            }
            if let Value::Table(t) = &node.value
                && !self.present(t, &id)?
            {
                continue;
            }
            let before = self.attempt;
            self.attempt = self.changes.again.get(&id).copied().unwrap_or(before);
            let at = if out.is_empty() { String::new() } else { format!("{out}[{}]", list.len()) };
            let value = self.value(node, &id, &at, drawn || copies.is_some());
            self.attempt = before;
            list.push(value?);
        }
        Ok(())
    }

    fn draw(&mut self, d: &Distribution, node: &Node, id: &str, out: &str) -> Result<toml::Value> {
        let (kind, of, limits) = match d {
            Distribution::Choice { values, weights } => {
                let i = chosen(values.len(), weights.as_deref(), self.unit(id));
                self.always(&values[i])?;
                return self.value(&values[i], &format!("{id}<{i}>"), out, true);
            }
            Distribution::Named { name, times, plus } => return self.shared(name, times, plus, node, id),
            Distribution::Numbers { kind, of, limits } => (*kind, of, limits),
        };
        let [a, b] = self.pair(of, id)?;
        let limits = limits.as_ref().map(|p| self.pair(p, &format!("{id}.limits"))).transpose()?;
        check(&self.doc, &node.span, kind, [a, b], limits)?;
        let u = self.unit(id);
        let between = |[a, b]: [f64; 2]| (a + (b - a) * u).clamp(a, b);
        Ok(match kind {
            Kind::Uniform => toml::Value::Float(between([a, b])),
            Kind::LogUniform => toml::Value::Float(between([a.ln(), b.ln()]).exp().clamp(a, b)),
            Kind::Integer => toml::Value::Integer((a + ((b - a + 1.0) * u).floor()).min(b) as i64),
            Kind::Normal => {
                let [least, greatest] = limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
                // The middle of its 2^-53: zero itself lies infinitely far out.
                let u = u + 0.5 / (1u64 << 53) as f64;
                let x = normal_between(a, b, least, greatest, u);
                toml::Value::Float(finite(&self.doc, &node.span, x)?)
            }
        })
    }

    fn shared(
        &mut self,
        name: &str,
        times: &Option<Node>,
        plus: &Option<Node>,
        node: &Node,
        id: &str,
    ) -> Result<toml::Value> {
        let tree = self.tree;
        let value = match (self.shared.get(name), tree.named.get(name)) {
            (Some(v), _) => v.clone(),
            (None, Some(shared)) => {
                self.always(shared)?;
                // The same for all references, also for those that are drawn again.
                let before = std::mem::take(&mut self.attempt);
                let v = self.value(shared, &format!("draw.{name}"), "", true);
                self.attempt = before;
                let v = v?;
                self.shared.insert(name.to_string(), v.clone());
                v
            }
            (None, None) => return Err(Error::Failed(format!("there is no draw '{name}'"))),
        };
        if times.is_none() && plus.is_none() {
            return Ok(value);
        }
        let k = times.as_ref().map(|n| self.number(n, &format!("{id}.times"))).transpose()?.unwrap_or(1.0);
        let c = plus.as_ref().map(|n| self.number(n, &format!("{id}.plus"))).transpose()?.unwrap_or(0.0);
        let Some(x) = number_of(&value) else {
            let b = self.doc.bad(&node.span, format!("the draw '{name}' is not a number"));
            return Err(b.remedy("remove times and plus").into());
        };
        let y = x * k + c;
        let whole = matches!(value, toml::Value::Integer(_)) && k.fract() == 0.0 && c.fract() == 0.0;
        Ok(if whole && y.abs() < MAX_INTEGER {
            toml::Value::Integer(y as i64)
        } else {
            toml::Value::Float(y)
        })
    }
}

/// A word of 64 random bits for (seed, scene, path, attempt).
pub fn word(seed: u64, scene: u32, path: &str, attempt: u32) -> u64 {
    let hash = Sha256::digest(path.as_bytes());
    let part = |i: usize| u32::from_le_bytes([hash[i], hash[i + 1], hash[i + 2], hash[i + 3]]);
    let [a, b, ..] = philox4x32_10([part(0), part(4), scene, attempt], [seed as u32, (seed >> 32) as u32]);
    u64::from(a) << 32 | u64::from(b)
}

fn chosen(n: usize, weights: Option<&[f64]>, u: f64) -> usize {
    let Some(weights) = weights else { return ((n as f64 * u) as usize).min(n - 1) };
    let aim = u * weights.iter().sum::<f64>();
    let mut sum = 0.0;
    for (i, w) in weights.iter().enumerate() {
        sum += w;
        if aim < sum {
            return i;
        }
    }
    // Rounding: the last one that can be.
    weights.iter().rposition(|w| *w > 0.0).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn tree(text: &str) -> Tree {
        Tree::parse(Path::new("r.toml"), text).unwrap()
    }

    fn refused(text: &str) -> String {
        Tree::parse(Path::new("r.toml"), text).unwrap_err().to_string()
    }

    fn plain_with(tree: &Tree, seed: u64, scene: u32, changes: &Changes) -> toml::Value {
        let mut draws = Draws::new(tree, seed, scene, changes.clone()).unwrap();
        draws.plain(tree.get("road").unwrap(), "road").unwrap().unwrap()
    }

    fn plain(tree: &Tree, scene: u32) -> toml::Value {
        plain_with(tree, 1, scene, &Changes::default())
    }

    /// `x` of many scenes.
    fn sample(distribution: &str, n: u32) -> Vec<f64> {
        let tree = tree(&format!("[road]\nx = {distribution}\n"));
        (0..n).map(|s| number_of(&plain(&tree, s)["x"]).unwrap()).collect()
    }

    fn mean_and_variance(x: &[f64]) -> (f64, f64) {
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        (mean, x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n)
    }

    /// Largest distance of the sample's distribution function from `cdf`, times √n (Kolmogorov).
    fn kolmogorov(mut x: Vec<f64>, cdf: impl Fn(f64) -> f64) -> f64 {
        x.sort_by(f64::total_cmp);
        let n = x.len() as f64;
        let gap = |(i, x): (usize, &f64)| {
            let p = cdf(*x);
            (p - i as f64 / n).abs().max(((i + 1) as f64 / n - p).abs())
        };
        n.sqrt() * x.iter().enumerate().map(gap).fold(0.0, f64::max)
    }

    /// 1.95 is exceeded with a probability of 0.001.
    const KOLMOGOROV_LIMIT: f64 = 1.95;
    const DRAWS: u32 = 4000;

    #[test]
    fn draws_follow_their_distributions() {
        let n = Normal::new(0.0, 1.0).unwrap();
        let d = kolmogorov(sample("{ uniform = [-2, 6] }", DRAWS), |x| (x + 2.0) / 8.0);
        assert!(d < KOLMOGOROV_LIMIT, "uniform {d}");
        let d = kolmogorov(sample("{ log_uniform = [1, 1000] }", DRAWS), |x| x.ln() / 1000f64.ln());
        assert!(d < KOLMOGOROV_LIMIT, "log_uniform {d}");
        let d = kolmogorov(sample("{ normal = [3, 2] }", DRAWS), |x| n.cdf((x - 3.0) / 2.0));
        assert!(d < KOLMOGOROV_LIMIT, "normal {d}");
        // The test can fail: another mean by a tenth of a deviation is seen.
        let d = kolmogorov(sample("{ normal = [3, 2] }", DRAWS), |x| n.cdf((x - 3.2) / 2.0));
        assert!(d > KOLMOGOROV_LIMIT, "shifted normal {d}");
        let cut = sample("{ normal = [0, 1], limits = [1, 3] }", DRAWS);
        assert!(cut.iter().all(|x| (1.0..=3.0).contains(x)));
        let (p, q) = (n.cdf(1.0), n.cdf(3.0));
        let d = kolmogorov(cut, |x| (n.cdf(x) - p) / (q - p));
        assert!(d < KOLMOGOROV_LIMIT, "cut normal {d}");
        // Far out, where 1 - cdf has no digits left: the tail is close to exponential with mean 1/30.
        let far = sample("{ normal = [0, 1], limits = [30, 40] }", DRAWS);
        let (mean, _) = mean_and_variance(&far);
        assert!((mean - 30.0 - 1.0 / 30.0).abs() < 0.003, "{mean}");
        let mirrored = sample("{ normal = [0, 1], limits = [-40, -30] }", DRAWS);
        assert!((mean_and_variance(&mirrored).0 + 30.0 + 1.0 / 30.0).abs() < 0.003);
    }

    #[test]
    fn integers_and_choices_have_their_shares() {
        // Binomial counts within 4.5 deviations, 1e-5 in all.
        let near = |count: usize, p: f64| {
            let n = f64::from(DRAWS);
            (count as f64 - n * p).abs() < 4.5 * (n * p * (1.0 - p)).sqrt()
        };
        let x = sample("{ integer = [-1, 3] }", DRAWS);
        for k in -1..=3 {
            assert!(near(x.iter().filter(|x| **x == f64::from(k)).count(), 0.2), "{k}");
        }
        let x = sample("{ choice = [10, 20, 30], weights = [1, 0, 3] }", DRAWS);
        assert!(near(x.iter().filter(|x| **x == 10.0).count(), 0.25));
        assert!(x.iter().all(|x| *x != 20.0));
        let tree = tree("[road]\n[[road.v]]\nchance = 0.3\nx = 1\n");
        let there = |s: u32| plain(&tree, s)["v"].as_array().unwrap().len();
        assert!(near((0..DRAWS).map(there).sum(), 0.3));
        assert_eq!(sample("{ uniform = [2, 2] }", 3), [2.0; 3]);
        assert_eq!(sample("{ normal = [2, 0] }", 3), [2.0; 3]);
    }

    #[test]
    fn neighbours_are_independent() {
        let tree = tree("[road]\nx = { normal = [0, 1] }\ny = { normal = [0, 1] }\n");
        let pair = |s| {
            let v = plain(&tree, s);
            (number_of(&v["x"]).unwrap(), number_of(&v["y"]).unwrap())
        };
        let all: Vec<(f64, f64)> = (0..DRAWS).map(pair).collect();
        let limit = 4.5 / f64::from(DRAWS).sqrt();
        let of = |f: &dyn Fn(usize) -> f64| (1..all.len()).map(f).sum::<f64>() / all.len() as f64;
        assert!(of(&|i| all[i].0 * all[i].1).abs() < limit, "keys");
        assert!(of(&|i| all[i].0 * all[i - 1].0).abs() < limit, "scenes");
        // Copies of one table are drawn for themselves.
        let tree = super::Tree::parse(
            Path::new("r.toml"),
            "[road]\n[[road.v]]\nrepeat = 2\nx = { normal = [0, 1] }\n",
        )
        .unwrap();
        let product = |s| {
            let v = plain(&tree, s);
            number_of(&v["v"][0]["x"]).unwrap() * number_of(&v["v"][1]["x"]).unwrap()
        };
        assert!(((0..DRAWS).map(product).sum::<f64>() / f64::from(DRAWS)).abs() < limit, "copies");
    }

    #[test]
    fn other_keys_and_the_order_change_nothing() {
        let v = "[[road.v]]\nrepeat = { integer = [1, 5] }\ns = { uniform = [0, 9] }\nkind = { choice = [\"a\", \"b\"] }\n";
        let one = tree(&format!("[road]\nx = {{ uniform = [0, 1] }}\n{v}"));
        let more = tree(&format!(
            "[draw]\nd = {{ integer = [0, 9] }}\n[road]\nnew = {{ draw = \"d\" }}\nx = {{ uniform = [0, 1] }}\n[road.t]\ny = {{ normal = [0, 1] }}\n{v}"
        ));
        for scene in [7, 0, 3] {
            let (a, b) = (plain(&one, scene), plain(&more, scene));
            assert_eq!((&a["x"], &a["v"]), (&b["x"], &b["v"]));
            assert_eq!(a, plain(&one, scene));
        }
        assert_ne!(plain(&one, 0), plain(&one, 1));
        assert_ne!(plain(&one, 0), plain_with(&one, 2, 0, &Changes::default()));
    }

    #[test]
    fn shared_draws_are_shared() {
        let tree = tree(
            "[draw]\nw = { uniform = [3, 4] }\nhalf = { draw = \"w\", times = 0.5 }\nn = { integer = [1, 3] }\n\
             [road]\na = { draw = \"w\" }\nb = { draw = \"w\", times = -2, plus = 1 }\nc = { draw = \"half\" }\n\
             d = { draw = \"n\", plus = 1 }\nlist = [{ draw = \"w\" }, { draw = \"w\" }]\n\
             [[road.v]]\nrepeat = { draw = \"n\" }\nx = { draw = \"w\" }\n",
        );
        for scene in 0..20 {
            let v = plain(&tree, scene);
            let a = v["a"].as_float().unwrap();
            assert_eq!((v["b"].as_float(), v["c"].as_float()), (Some(1.0 - 2.0 * a), Some(0.5 * a)));
            assert_eq!(v["list"][0], v["list"][1]);
            assert_eq!(v["d"].as_integer().unwrap() - 1, v["v"].as_array().unwrap().len() as i64);
            assert!(v["v"].as_array().unwrap().iter().all(|e| e["x"] == v["a"]));
        }
    }

    #[test]
    fn elements_are_drawn_again_and_left_out_by_themselves() {
        let tree = tree(
            "[road]\n[[road.v]]\nrepeat = 3\nx = { uniform = [0, 1] }\n[[road.v]]\nx = { uniform = [0, 1] }\n",
        );
        let before = plain(&tree, 5);
        let mut changes = Changes::default();
        changes.again.insert("road.v[0]#1".into(), 2);
        let again = plain_with(&tree, 1, 5, &changes);
        let same = |i: usize| before["v"][i] == again["v"][i];
        assert_eq!([0, 1, 2, 3].map(same), [true, false, true, true]);
        changes.dropped.insert("road.v[0]#0".into());
        let dropped = plain_with(&tree, 1, 5, &changes);
        assert_eq!(dropped["v"].as_array().unwrap()[..], again["v"].as_array().unwrap()[1..]);
        // What is left says where it came from.
        let mut draws = Draws::new(&tree, 1, 5, changes).unwrap();
        draws.plain(tree.get("road").unwrap(), "road").unwrap();
        let origins = draws.origins();
        assert_eq!(origins["road.v[1]"].id, "road.v[0]#2");
        assert_eq!(origins["road.v[2].x"].id, "road.v[1].x");
        assert!(origins["road.v[2].x"].drawn && !origins["road.v"].drawn);
    }

    #[test]
    fn mistakes_are_named_with_their_place() {
        for (text, says) in [
            (
                "[road]\nx = { uniform = [2, 1] }",
                "r.toml:2: road.x: the first value of uniform, 2, is greater than the second, 1",
            ),
            (
                "[road]\nx = { uniform = [2] }",
                "is not [minimum, maximum]; write for example uniform = [0, 1]",
            ),
            ("[road]\nx = { uniform = [1, nan] }", "is not a finite number"),
            ("[road]\nx = { uniform = [1, \"b\"] }", "is not a finite number"),
            (
                "[road]\nx = { uniform = [1, 2], limit = [0, 1] }",
                "is not a key of the distribution uniform; allowed: uniform",
            ),
            ("[road]\nx = { normal = [1, 2], limit = [0, 1] }", "did you mean 'limits'?"),
            ("[road]\nx = { normal = [1, -2] }", "the standard deviation is -2"),
            (
                "[road]\nx = { normal = [0, 1], limits = [3, 2] }",
                "the first value of limits, 3, is greater than the second, 2",
            ),
            (
                "[road]\nx = { normal = [0, 1], limits = [50, 60] }",
                "has practically no values between 50 and 60",
            ),
            ("[road]\nx = { log_uniform = [0, 2] }", "the minimum of log_uniform is 0"),
            ("[road]\nx = { integer = [0, 2.5] }", "2.5 is not an integer, or is too large for one"),
            ("[road]\nx = { choice = [1, 2], weights = [1] }", "has 1 weights for 2 values"),
            (
                "[road]\nx = { choice = [1, 2], weights = [0, 0] }",
                "the weights are not numbers of 0 or more with a positive, finite sum",
            ),
            (
                "[road]\nx = { choice = [1, 2], weights = [1, -1] }",
                "the weights are not numbers of 0 or more with a positive, finite sum",
            ),
            ("[road]\nx = { choice = [] }", "the list is empty"),
            ("[road]\nx = { choice = 3 }", "is not a list"),
            ("[road]\nx = { choice = [1], uniform = [0, 1] }", "names two distributions: uniform and choice"),
            (
                "[draw]\nwidth = 3\n[road]\nx = { draw = \"widht\" }",
                "r.toml:4: road.x: there is no draw 'widht'",
            ),
            ("[draw]\nwidth = 3\n[road]\nx = { draw = \"widht\" }", "did you mean 'width'?"),
            (
                "[draw]\na = { draw = \"b\" }\nb = { draw = \"a\", plus = 1 }\n",
                "the draw depends on itself: a -> b -> a",
            ),
            ("[draw]\na = { uniform = [{ draw = \"a\" }, 2] }\n", "the draw depends on itself: a -> a"),
            ("[[road.v]]\nchance = 1.5\n", "r.toml:2: road.v[0].chance = 1.5: is not a probability"),
            ("x = 2020-01-01\n", "is a date"),
            ("x = 99999999999999999999\n", "is too large"),
        ] {
            let e = refused(text);
            assert!(e.contains(says) && !e.contains('\n'), "{text}: {e}");
        }
        // What only a scene decides.
        for (text, says) in [
            ("[road]\nx = { uniform = [{ uniform = [1, 2] }, 0.5] }", "is greater than the second, 0.5"),
            (
                "[draw]\nk = { choice = [\"a\"] }\n[road]\nx = { draw = \"k\", times = 2 }",
                "the draw 'k' is not a number",
            ),
            ("[road]\nx = { choice = [{ repeat = 2, y = 1 }] }", "repeat outside an array has no effect"),
            ("[road.t]\nrepeat = 2\n", "repeat outside an array has no effect"),
            (
                "[road]\nx = { choice = [{ chance = 0.5, y = 1 }] }",
                "a table in a choice or a draw cannot have a chance",
            ),
            (
                "[draw]\nt = { chance = 0.5, y = 1 }\n[road]\nx = { draw = \"t\" }",
                "a table in a choice or a draw cannot have a chance",
            ),
            ("[[road.v]]\nrepeat = { uniform = [0.1, 0.9] }\n", "is not a number of copies"),
            ("[[road.v]]\nrepeat = -1\n", "-1 is not a number of copies; allowed: 0..=10000"),
            ("[[road.v]]\nchance = { uniform = [2, 3] }\n", "allowed: 0..=1"),
        ] {
            let tree = tree(text);
            let mut draws = Draws::new(&tree, 1, 0, Changes::default()).unwrap();
            let e = draws.plain(tree.get("road").unwrap(), "road").unwrap_err().to_string();
            assert!(e.contains(says) && e.starts_with("r.toml:") && !e.contains('\n'), "{text}: {e}");
        }
    }

    proptest! {
        /// Whatever stands in the file, a message of one line or a value.
        #[test]
        fn text_never_panics(text in "[ -~\n\"\\[\\]{}=.a-z0-9]{0,80}") {
            for text in [text.clone(), format!("[road]\nx = {{ uniform = {text} }}"), format!("[road]\nx = {{ {text} = [1, 2] }}")] {
                match Tree::parse(Path::new("r.toml"), &text) {
                    Err(e) => prop_assert!(!e.to_string().contains('\n')),
                    Ok(tree) => if let Some(node) = tree.get("road") {
                        let _ = Draws::new(&tree, 1, 0, Changes::default()).unwrap().plain(node, "road");
                    }
                }
            }
        }

        /// A draw lies within its bounds, and its text reads back as the same number.
        #[test]
        fn draws_keep_their_bounds(a in -1e9f64..1e9, w in 0f64..1e6, scene in 0u32..1000) {
            let tree = tree(&format!("[road]\nx = {{ uniform = [{a:?}, {:?}] }}\n", a + w));
            let v = plain(&tree, scene);
            let x = v["x"].as_float().unwrap();
            prop_assert!((a..=a + w).contains(&x));
            let text = toml::to_string(&v).unwrap();
            prop_assert_eq!(toml::from_str::<toml::Value>(&text).unwrap()["x"].as_float(), Some(x));
        }
    }
}
