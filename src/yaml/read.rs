//! A node as a serde deserializer, with the place and path of whatever goes wrong inside.
//!
//! typetag passes errors of the inner deserializer on as strings. The first failure is therefore noted, with its place,
//! where it happens; outer layers only learn that there was one.

mod access;
mod failure;

use super::{Node, Value, join, scalar};
use crate::error::{Diagnostic, Location};
use access::{EnumReader, ListReader, MapReader};
use failure::Failure;
pub(super) use failure::cropped;
use scalar::WrittenNumber;
use serde::de::{Deserialize, Deserializer, Error as _, Expected, Unexpected, Visitor};
use std::cell::OnceCell;

impl Node {
    /// The node as a value of any type that serde can deserialize; `path` is the dotted path of this node.
    ///
    /// Numbers are read from quoted scalars too, whole numbers from `1e3` too; booleans are `true` and `false` alone. Of a
    /// trait object the key `type` is read first, wherever it is.
    ///
    /// # Errors
    /// The first error, with the place and path of the value or key at fault (a missing key: of the map).
    pub fn read<'de, T: Deserialize<'de>>(&'de self, path: &str) -> Result<T, Diagnostic> {
        let first = OnceCell::new();
        let trail = Trail::Root(path);
        let reader = NodeReader {
            node: self,
            trail: &trail,
            first: &first,
        };
        T::deserialize(reader).map_err(|failure| {
            first
                .into_inner()
                .unwrap_or_else(|| failure.diagnostic(self.location.clone(), path.to_owned()))
        })
    }
}

/// The path of a node, kept on the stack until a message needs it.
#[derive(Clone, Copy)]
enum Trail<'t> {
    Root(&'t str),
    Key(&'t Trail<'t>, &'t str),
    Index(&'t Trail<'t>, usize),
}

impl Trail<'_> {
    fn path(&self) -> String {
        match self {
            Trail::Root(path) => (*path).to_owned(),
            Trail::Key(parent, key) => join(&parent.path(), key),
            Trail::Index(parent, index) => join(&parent.path(), index),
        }
    }
}

#[derive(Clone, Copy)]
struct NodeReader<'de, 't> {
    node: &'de Node,
    trail: &'t Trail<'t>,
    first: &'t OnceCell<Diagnostic>,
}

/// Notes the place of a failure, unless an inner place has been noted.
fn note<T>(
    result: Result<T, Failure>,
    first: &OnceCell<Diagnostic>,
    location: Option<&Location>,
    trail: &Trail<'_>,
) -> Result<T, Failure> {
    if let Err(failure) = &result {
        first.get_or_init(|| failure.diagnostic(location.cloned(), trail.path()));
    }
    result
}

impl<'de> NodeReader<'de, '_> {
    fn noted<T>(&self, result: Result<T, Failure>) -> Result<T, Failure> {
        note(result, self.first, self.node.location.as_ref(), self.trail)
    }

    fn unexpected(&self) -> Unexpected<'de> {
        match &self.node.value {
            Value::List(_) => Unexpected::Seq,
            Value::Map(_) => Unexpected::Map,
            Value::Scalar { .. } if self.node.is_null() => Unexpected::Unit,
            Value::Scalar { text, plain: true } => {
                match (scalar::boolean(text), scalar::number(text)) {
                    (Some(b), _) => Unexpected::Bool(b),
                    (_, Some(WrittenNumber::Unsigned(n))) => Unexpected::Unsigned(n),
                    (_, Some(WrittenNumber::Signed(n))) => Unexpected::Signed(n),
                    (_, Some(WrittenNumber::Float(x))) => Unexpected::Float(x),
                    _ => Unexpected::Str(text),
                }
            }
            Value::Scalar { text, .. } => Unexpected::Str(text),
        }
    }

    fn refused<T>(&self, wanted: &dyn Expected) -> Result<T, Failure> {
        self.noted(Err(Failure::invalid_type(self.unexpected(), wanted)))
    }

    /// The numeric value of a scalar, quoted or not.
    fn number(&self) -> Option<WrittenNumber> {
        match &self.node.value {
            Value::Scalar { text, .. } => scalar::number(text),
            _ => None,
        }
    }

    fn visit_float<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let Some(number) = self.number() else {
            return self.refused(&visitor);
        };
        let value = number.as_f64();
        self.noted(if value.is_finite() {
            visitor.visit_f64(value)
        } else {
            Err(Failure::not_finite(self.node))
        })
    }

    fn visit_whole<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        self.noted(match self.number().map(WrittenNumber::whole) {
            None => return self.refused(&visitor),
            Some(WrittenNumber::Unsigned(n)) => visitor.visit_u64(n),
            Some(WrittenNumber::Signed(n)) => visitor.visit_i64(n),
            Some(WrittenNumber::Float(x)) if x.is_finite() => {
                Err(Failure::invalid_value(Unexpected::Float(x), &visitor))
            }
            Some(WrittenNumber::Float(_)) => Err(Failure::not_finite(self.node)),
        })
    }

    fn visit_text<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        match &self.node.value {
            Value::Scalar { text, .. } if !self.node.is_null() => {
                self.noted(visitor.visit_borrowed_str(text))
            }
            _ => self.refused(&visitor),
        }
    }

    fn visit_list<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let Value::List(list) = &self.node.value else {
            return self.refused(&visitor);
        };
        let wanted = (&visitor as &dyn Expected).to_string();
        let mut access = ListReader {
            reader: self,
            list,
            next: 0,
        };
        let value = self.noted(visitor.visit_seq(&mut access))?;
        if access.next < list.len() {
            return self.noted(Err(Failure::invalid_length(list.len(), &wanted.as_str())));
        }
        Ok(value)
    }

    fn visit_entries<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let Value::Map(map) = &self.node.value else {
            return self.refused(&visitor);
        };
        // typetag buffers everything before the tag, and places would be lost: its tag comes first. Its visitors say
        // "dyn Trait"; other maps keep their order.
        let trait_object = (&visitor as &dyn Expected).to_string().starts_with("dyn ");
        let tag = trait_object
            .then(|| map.get_key_value("type"))
            .flatten()
            .map(|(key, entry)| (key.as_str(), entry));
        let access = MapReader {
            reader: self,
            first: tag,
            rest: map.iter(),
            skip_tag: tag.is_some(),
            current: None,
        };
        self.noted(visitor.visit_map(access))
    }
}

macro_rules! forward {
    ($target:ident: $($method:ident)*) => {
        $(fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
            self.$target(visitor)
        })*
    };
}

impl<'de> Deserializer<'de> for NodeReader<'de, '_> {
    type Error = Failure;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        match self.unexpected() {
            Unexpected::Seq => self.visit_list(visitor),
            Unexpected::Map => self.visit_entries(visitor),
            Unexpected::Unit => self.noted(visitor.visit_unit()),
            Unexpected::Bool(b) => self.noted(visitor.visit_bool(b)),
            Unexpected::Unsigned(n) => self.noted(visitor.visit_u64(n)),
            Unexpected::Signed(n) => self.noted(visitor.visit_i64(n)),
            Unexpected::Float(_) => self.visit_float(visitor),
            _ => self.visit_text(visitor),
        }
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        match self.unexpected() {
            Unexpected::Bool(b) => self.noted(visitor.visit_bool(b)),
            _ => self.refused(&visitor),
        }
    }

    forward!(visit_float: deserialize_f32 deserialize_f64);
    forward!(visit_whole: deserialize_i8 deserialize_i16 deserialize_i32 deserialize_i64 deserialize_i128
        deserialize_u8 deserialize_u16 deserialize_u32 deserialize_u64 deserialize_u128);
    forward!(visit_text: deserialize_char deserialize_str deserialize_string deserialize_identifier
        deserialize_bytes deserialize_byte_buf);
    forward!(visit_list: deserialize_seq);
    forward!(visit_entries: deserialize_map);

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        if self.node.is_null() {
            visitor.visit_none()
        } else {
            visitor.visit_some(self)
        }
    }

    fn deserialize_unit<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        if self.node.is_null() {
            self.noted(visitor.visit_unit())
        } else {
            self.refused(&visitor)
        }
    }

    fn deserialize_unit_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Failure> {
        // A law without parameters is an empty map after its tag.
        match &self.node.value {
            Value::Map(map) if map.is_empty() => self.noted(visitor.visit_unit()),
            _ => self.deserialize_unit(visitor),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Failure> {
        self.noted(visitor.visit_newtype_struct(self))
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        _len: usize,
        visitor: V,
    ) -> Result<V::Value, Failure> {
        self.visit_list(visitor)
    }

    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _len: usize,
        visitor: V,
    ) -> Result<V::Value, Failure> {
        self.visit_list(visitor)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Failure> {
        self.visit_entries(visitor)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Failure> {
        match &self.node.value {
            Value::Scalar { .. } if !self.node.is_null() => {
                let access = EnumReader {
                    reader: self,
                    entry: None,
                };
                self.noted(visitor.visit_enum(access))
            }
            Value::Map(map) if map.len() == 1 => {
                let entry = map.first().map(|(key, entry)| (key.as_str(), entry));
                let access = EnumReader {
                    reader: self,
                    entry,
                };
                self.noted(visitor.visit_enum(access))
            }
            Value::Map(map) => self.noted(Err(Failure::invalid_length(
                map.len(),
                &"a word or a map with one key",
            ))),
            _ => self.refused(&visitor),
        }
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        visitor.visit_unit()
    }
}
