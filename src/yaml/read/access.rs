//! Lists, maps, keys and variants for serde, one entry at a time, each with its path.

use super::failure::Failure;
use super::{NodeReader, Trail, note};
use crate::error::{Diagnostic, Location};
use crate::yaml::{Entry, Node, Value};
use serde::de::{self, DeserializeSeed, Deserializer, Error as _, Visitor};
use std::cell::OnceCell;

/// The entries of a list.
pub(super) struct ListReader<'de, 't> {
    pub reader: NodeReader<'de, 't>,
    pub list: &'de [Node],
    /// Index of the next entry.
    pub next: usize,
}

impl<'de> de::SeqAccess<'de> for &mut ListReader<'de, '_> {
    type Error = Failure;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Failure> {
        let Some(node) = self.list.get(self.next) else {
            return Ok(None);
        };
        let trail = Trail::Index(self.reader.trail, self.next);
        self.next += 1;
        let reader = NodeReader {
            node,
            trail: &trail,
            first: self.reader.first,
        };
        reader.noted(seed.deserialize(reader)).map(Some)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.list.len() - self.next)
    }
}

/// The entries of a map.
pub(super) struct MapReader<'de, 't> {
    pub reader: NodeReader<'de, 't>,
    /// The tag of a trait object, read before the rest.
    pub first: Option<(&'de str, &'de Entry)>,
    pub rest: indexmap::map::Iter<'de, String, Entry>,
    pub skip_tag: bool,
    /// The entry whose key was read last.
    pub current: Option<(&'de str, &'de Entry)>,
}

impl<'de> de::MapAccess<'de> for MapReader<'de, '_> {
    type Error = Failure;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Failure> {
        let skip = self.skip_tag;
        let mut rest = self
            .rest
            .by_ref()
            .map(|(key, entry)| (key.as_str(), entry))
            .filter(|(key, _)| !skip || *key != "type");
        self.current = self.first.take().or_else(|| rest.next());
        let Some((key, entry)) = self.current else {
            return Ok(None);
        };
        let trail = Trail::Key(self.reader.trail, key);
        let reader = KeyReader {
            key,
            place: entry.key_location.as_ref().or(entry.node.location.as_ref()),
            trail: &trail,
            first: self.reader.first,
        };
        seed.deserialize(reader).map(Some)
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, Failure> {
        let Some((key, entry)) = self.current.take() else {
            return Err(Failure::custom("a value was requested before its key"));
        };
        let trail = Trail::Key(self.reader.trail, key);
        let reader = NodeReader {
            node: &entry.node,
            trail: &trail,
            first: self.reader.first,
        };
        reader.noted(seed.deserialize(reader))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }
}

/// A key or the name of a variant; notes failures itself, before typetag turns them into strings.
struct KeyReader<'de, 't> {
    key: &'de str,
    place: Option<&'de Location>,
    trail: &'t Trail<'t>,
    first: &'t OnceCell<Diagnostic>,
}

impl<'de> Deserializer<'de> for KeyReader<'de, '_> {
    type Error = Failure;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Failure> {
        let result = visitor.visit_borrowed_str(self.key);
        note(result, self.first, self.place, self.trail)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Failure> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Failure> {
        let word = de::value::BorrowedStrDeserializer::new(self.key);
        note(visitor.visit_enum(word), self.first, self.place, self.trail)
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit
        unit_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}

/// A variant: a word, or the only key of a map with its value.
pub(super) struct EnumReader<'de, 't> {
    pub reader: NodeReader<'de, 't>,
    pub entry: Option<(&'de str, &'de Entry)>,
}

impl<'de, 't> de::EnumAccess<'de> for EnumReader<'de, 't> {
    type Error = Failure;
    type Variant = EnumReader<'de, 't>;

    fn variant_seed<V: DeserializeSeed<'de>>(
        self,
        seed: V,
    ) -> Result<(V::Value, Self::Variant), Failure> {
        let NodeReader { node, trail, first } = self.reader;
        let value = match (self.entry, &node.value) {
            (Some((key, entry)), _) => seed.deserialize(KeyReader {
                key,
                place: entry.key_location.as_ref(),
                trail: &Trail::Key(trail, key),
                first,
            }),
            (None, Value::Scalar { text, .. }) => seed.deserialize(KeyReader {
                key: text,
                place: node.location.as_ref(),
                trail,
                first,
            }),
            (None, _) => self.reader.refused(&"a word"),
        }?;
        Ok((value, self))
    }
}

impl<'de> EnumReader<'de, '_> {
    /// Hands the value of the only key on.
    fn with_value<T>(
        self,
        visit: impl FnOnce(NodeReader<'de, '_>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let Some((key, entry)) = self.entry else {
            return self.reader.noted(Err(Failure::custom(format!(
                "found {} alone, wanted it as a key with a value",
                self.reader.node.describe()
            ))));
        };
        let trail = Trail::Key(self.reader.trail, key);
        visit(NodeReader {
            node: &entry.node,
            trail: &trail,
            first: self.reader.first,
        })
    }
}

impl<'de> de::VariantAccess<'de> for EnumReader<'de, '_> {
    type Error = Failure;

    fn unit_variant(self) -> Result<(), Failure> {
        match self.entry {
            None => Ok(()),
            Some(_) => self.with_value(|reader| de::Deserialize::deserialize(reader)),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Failure> {
        self.with_value(|reader| reader.noted(seed.deserialize(reader)))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _len: usize, visitor: V) -> Result<V::Value, Failure> {
        self.with_value(|reader| reader.visit_list(visitor))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Failure> {
        self.with_value(|reader| reader.visit_entries(visitor))
    }
}
