//! A parameter which is one value everywhere, or varies over a surface by a texture.

use glam::Vec3;
use serde::de::{self, Deserialize, Deserializer, SeqAccess, Visitor};
use std::fmt;

/// A linear colour or spectral triple in the working space (Rec. 709 primaries, D65).
pub type Rgb = Vec3;

/// A parameter of a surface: constant, or looked up in a texture.
///
/// `R` is how a texture is referred to: by name in a description, by `Entity` in a world, by
/// index in the arrays of a frame. In a scene file: a number, a colour `(r, g, b)` or a name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<T, R> {
    /// The same everywhere.
    Constant(T),
    /// Read from this texture at the uv of the point.
    Texture(R),
}

impl<T, R> Value<T, R> {
    /// The same parameter with its reference replaced.
    ///
    /// # Errors
    /// Whatever `f` returns.
    pub fn map_ref<S, E>(self, f: &mut impl FnMut(R) -> Result<S, E>) -> Result<Value<T, S>, E> {
        Ok(match self {
            Self::Constant(value) => Value::Constant(value),
            Self::Texture(reference) => Value::Texture(f(reference)?),
        })
    }

    /// The texture that is read, if any.
    pub fn texture(&self) -> Option<&R> {
        match self {
            Self::Constant(_) => None,
            Self::Texture(reference) => Some(reference),
        }
    }
}

impl<T, R> From<T> for Value<T, R> {
    fn from(value: T) -> Self {
        Self::Constant(value)
    }
}

impl<'de> Deserialize<'de> for Value<Rgb, String> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ColorVisitor;
        impl<'de> Visitor<'de> for ColorVisitor {
            type Value = Value<Rgb, String>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number, a colour (r, g, b) or the name of a texture")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Self::Value, E> {
                Ok(Value::Constant(Rgb::splat(v as f32)))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Self::Value, E> {
                Ok(Value::Constant(Rgb::splat(v as f32)))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<Self::Value, E> {
                Ok(Value::Constant(Rgb::splat(v as f32)))
            }
            fn visit_str<E: de::Error>(self, v: &str) -> Result<Self::Value, E> {
                Ok(Value::Texture(v.to_owned()))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
                let mut rgb = [0.0_f32; 3];
                for (channel, slot) in rgb.iter_mut().enumerate() {
                    *slot = seq.next_element()?.ok_or_else(|| {
                        de::Error::invalid_length(channel, &"three numbers (r, g, b)")
                    })?;
                }
                if seq.next_element::<f32>()?.is_some() {
                    return Err(de::Error::invalid_length(4, &"three numbers (r, g, b)"));
                }
                Ok(Value::Constant(Rgb::from_array(rgb)))
            }
        }
        deserializer.deserialize_any(ColorVisitor)
    }
}

/// Reads a colour which no texture can give: a number is a grey, here as everywhere.
///
/// # Errors
/// When it is neither a number nor three of them.
pub(super) fn color<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Rgb, D::Error> {
    match Value::<Rgb, String>::deserialize(deserializer)? {
        Value::Constant(color) => Ok(color),
        Value::Texture(name) => Err(de::Error::invalid_type(
            de::Unexpected::Str(&name),
            &"a number or a colour (r, g, b): no texture is possible here",
        )),
    }
}

/// [`color`] where it may be left out.
///
/// # Errors
/// As for it.
pub(super) fn some_color<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Option<Rgb>, D::Error> {
    struct Color(Rgb);
    impl<'de> Deserialize<'de> for Color {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            color(deserializer).map(Self)
        }
    }
    Ok(Option::<Color>::deserialize(deserializer)?.map(|color| color.0))
}

impl<'de> Deserialize<'de> for Value<f32, String> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ScalarVisitor;
        impl Visitor<'_> for ScalarVisitor {
            type Value = Value<f32, String>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number or the name of a texture")
            }
            fn visit_f64<E: de::Error>(self, v: f64) -> Result<Self::Value, E> {
                Ok(Value::Constant(v as f32))
            }
            fn visit_i64<E: de::Error>(self, v: i64) -> Result<Self::Value, E> {
                Ok(Value::Constant(v as f32))
            }
            fn visit_u64<E: de::Error>(self, v: u64) -> Result<Self::Value, E> {
                Ok(Value::Constant(v as f32))
            }
            fn visit_str<E: de::Error>(self, v: &str) -> Result<Self::Value, E> {
                Ok(Value::Texture(v.to_owned()))
            }
        }
        deserializer.deserialize_any(ScalarVisitor)
    }
}
