//! A parsed TOML value as a serde deserializer, stricter than that of the `toml` crate: a list must have as many elements
//! as are read, and a table cannot be given as a list of its values. It is the only deserializer that tables of
//! settings are compiled for, and borrows the tree, which keeps what the compiler makes of them small.

use serde::de::value::BorrowedStrDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error as _, Expected, MapAccess, SeqAccess, Unexpected,
    VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;
use std::cell::Cell;
use std::fmt;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeInteger, DeTable, DeValue};

/// Name of the newtype that asks for the span of its value: see [`take_span`].
pub const SPANNED: &str = "a value and its span";

thread_local! {
    static SPAN: Cell<Option<(usize, usize)>> = const { Cell::new(None) };
}

/// Takes the bytes of the file where the value of a newtype of the name [`SPANNED`] stands; empty when the value comes
/// from elsewhere. `visit_newtype_struct` calls it first.
pub fn take_span() -> Range<usize> {
    SPAN.take().map_or(0..0, |(start, end)| start..end)
}

/// What is wrong with a value, and the bytes where it stands.
#[derive(Debug)]
pub struct Wrong {
    pub message: String,
    pub span: Option<Range<usize>>,
}

impl Wrong {
    fn at(mut self, span: Range<usize>) -> Self {
        self.span.get_or_insert(span);
        self
    }
}

impl fmt::Display for Wrong {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Wrong {}

impl serde::de::Error for Wrong {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Wrong { message: message.to_string(), span: None }
    }
}

type Read<T> = Result<T, Wrong>;

/// A value of the tree.
#[derive(Clone, Copy)]
pub struct Value<'t>(pub &'t Spanned<DeValue<'t>>);

impl Value<'_> {
    fn unexpected(&self) -> Unexpected<'_> {
        match self.0.get_ref() {
            DeValue::String(s) => Unexpected::Str(s),
            DeValue::Integer(i) => match whole(i) {
                Some(Whole::Signed(x)) => Unexpected::Signed(x),
                Some(Whole::Unsigned(x)) => Unexpected::Unsigned(x),
                None => Unexpected::Other("a number beyond 64 bits"),
            },
            DeValue::Float(x) => Unexpected::Float(x.as_str().parse().unwrap_or(f64::NAN)),
            DeValue::Boolean(b) => Unexpected::Bool(*b),
            DeValue::Array(_) => Unexpected::Seq,
            DeValue::Datetime(_) | DeValue::Table(_) => Unexpected::Map,
        }
    }
}

enum Whole {
    Signed(i64),
    Unsigned(u64),
}

fn whole(i: &DeInteger<'_>) -> Option<Whole> {
    let signed = i64::from_str_radix(i.as_str(), i.radix()).map(Whole::Signed);
    signed.or_else(|_| u64::from_str_radix(i.as_str(), i.radix()).map(Whole::Unsigned)).ok()
}

impl<'de> Deserializer<'de> for Value<'de> {
    type Error = Wrong;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        match self.0.get_ref() {
            DeValue::String(s) => visitor.visit_borrowed_str(s),
            DeValue::Integer(i) => match whole(i) {
                Some(Whole::Signed(x)) => visitor.visit_i64(x),
                Some(Whole::Unsigned(x)) => visitor.visit_u64(x),
                None => Err(Wrong::custom("integer number overflowed")),
            },
            DeValue::Float(x) => match x.as_str().parse() {
                Ok(x) => visitor.visit_f64(x),
                Err(_) => Err(Wrong::custom("floating-point number overflowed")),
            },
            DeValue::Boolean(b) => visitor.visit_bool(*b),
            DeValue::Datetime(_) => Err(Wrong::invalid_type(Unexpected::Map, &visitor)),
            DeValue::Array(a) => read_list(a, visitor),
            DeValue::Table(t) => visitor.visit_map(Entries::new(t)),
        }
        .map_err(|e| e.at(self.0.span()))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Read<V::Value> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, name: &'static str, visitor: V) -> Read<V::Value> {
        if name == SPANNED {
            let span = self.0.span();
            SPAN.set(Some((span.start, span.end)));
        }
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Read<V::Value> {
        match self.0.get_ref() {
            DeValue::Table(t) => visitor.visit_map(Entries::new(t)),
            _ => Err(Wrong::invalid_type(self.unexpected(), &visitor)),
        }
        .map_err(|e| e.at(self.0.span()))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Read<V::Value> {
        match self.0.get_ref() {
            DeValue::String(s) => visitor.visit_enum(BorrowedStrDeserializer::new(s)),
            DeValue::Table(t) => visitor.visit_enum(Entries::new(t)),
            _ => Err(Wrong::custom("wanted string or table")),
        }
        .map_err(|e| e.at(self.0.span()))
    }

    forward_to_deserialize_any! {
        bool u8 u16 u32 u64 u128 i8 i16 i32 i64 i128 f32 f64 char str string seq
        bytes byte_buf map unit ignored_any unit_struct tuple_struct tuple identifier
    }
}

/// The length that a list must have, in serde's words, so that a list that is too long is reported as one that is too
/// short.
struct ListOf(usize);

impl Expected for ListOf {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "an array of length {}", self.0)
    }
}

struct List<'a, 't>(&'a mut std::slice::Iter<'t, Spanned<DeValue<'t>>>);

fn read_list<'t, V: Visitor<'t>>(list: &'t [Spanned<DeValue<'t>>], visitor: V) -> Read<V::Value> {
    let mut rest = list.iter();
    let value = visitor.visit_seq(List(&mut rest))?;
    match rest.len() {
        0 => Ok(value),
        n => Err(Wrong::invalid_length(list.len(), &ListOf(list.len() - n))),
    }
}

impl<'de> SeqAccess<'de> for List<'_, 'de> {
    type Error = Wrong;

    fn next_element_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Read<Option<S::Value>> {
        self.0.next().map(|v| seed.deserialize(Value(v))).transpose()
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

type Entry<'t> = (&'t Spanned<std::borrow::Cow<'t, str>>, &'t Spanned<DeValue<'t>>);

/// The entries of a table in the order of the file.
struct Entries<'t> {
    list: Box<dyn Iterator<Item = Entry<'t>> + 't>,
    count: usize,
    value: Option<Value<'t>>,
}

impl<'t> Entries<'t> {
    fn new(table: &'t DeTable<'t>) -> Self {
        Entries { list: Box::new(table.iter()), count: table.len(), value: None }
    }

    fn next(&mut self) -> Option<Entry<'t>> {
        self.list.next()
    }
}

fn read_key<'t, S: DeserializeSeed<'t>>(
    key: &'t Spanned<std::borrow::Cow<'t, str>>,
    seed: S,
) -> Read<S::Value> {
    seed.deserialize(BorrowedStrDeserializer::new(key.get_ref())).map_err(|e: Wrong| e.at(key.span()))
}

impl<'de> MapAccess<'de> for Entries<'de> {
    type Error = Wrong;

    fn next_key_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Read<Option<S::Value>> {
        let Some((key, value)) = self.next() else { return Ok(None) };
        self.value = Some(Value(value));
        read_key(key, seed).map(Some)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Read<S::Value> {
        let value = self.value.take().ok_or_else(|| Wrong::custom("a value was asked for before its key"))?;
        seed.deserialize(value)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.count)
    }
}

impl<'de> EnumAccess<'de> for Entries<'de> {
    type Error = Wrong;
    type Variant = Value<'de>;

    fn variant_seed<S: DeserializeSeed<'de>>(mut self, seed: S) -> Read<(S::Value, Value<'de>)> {
        match self.next().filter(|_| self.count == 1) {
            Some((key, value)) => Ok((read_key(key, seed)?, Value(value))),
            None if self.count == 0 => Err(Wrong::custom("wanted exactly 1 element, found 0 elements")),
            None => Err(Wrong::custom("wanted exactly 1 element, more than 1 element")),
        }
    }
}

impl<'de> VariantAccess<'de> for Value<'de> {
    type Error = Wrong;

    fn unit_variant(self) -> Read<()> {
        match self.0.get_ref() {
            DeValue::Table(t) if t.is_empty() => Ok(()),
            _ => Err(Wrong::custom("wanted an empty table").at(self.0.span())),
        }
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Read<S::Value> {
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _len: usize, visitor: V) -> Read<V::Value> {
        self.deserialize_any(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(self, fields: &'static [&'static str], visitor: V) -> Read<V::Value> {
        self.deserialize_struct("", fields, visitor)
    }
}
