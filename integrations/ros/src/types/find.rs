//! Reading of single fields from data in CDR, little endian. Data in big endian are not recognised and are misread.
//!
//! Fields before the requested one are skipped without decoding them, because they may contain a large map or image.

use serde_json::Value;

use super::definition::Primitive;
use super::field::{FieldPath, Part};
use super::structure::{Layout, Structure};

const INCOMPLETE: &str = "the data end too early: the definition differs from that of the sender";

impl Structure {
    /// Returns the value of a field, or `None` for an element that a list does not have. NaN is null, and an infinite
    /// number is the text `inf` or `-inf`. `offset` is the number of bytes of the message that precede `data`; the
    /// alignment depends on it.
    ///
    /// # Errors
    /// The data are no message of this structure.
    pub(crate) fn find(&self, path: &FieldPath, data: &[u8], offset: usize) -> Result<Option<Value>, String> {
        let mut reader = Reader { data, position: 0, offset };
        reader.structure(self, &path.0)
    }

    /// Returns the text in a field, or `None` if the data contain no such text.
    pub(crate) fn text(&self, field: &str, data: &[u8]) -> Option<String> {
        let path = FieldPath::parse(field).ok()?;
        self.find(&path, data, 0).ok()??.as_str().map(str::to_owned)
    }
}

impl Layout {
    /// Decodes data that consist of one number, truth value or text.
    pub(super) fn read_single(&self, data: &[u8]) -> Result<Value, String> {
        let mut reader = Reader { data, position: 0, offset: 0 };
        Ok(reader.layout(self, &[])?.unwrap_or_default())
    }
}

struct Reader<'d> {
    data: &'d [u8],
    position: usize,
    offset: usize,
}

impl Reader<'_> {
    fn take(&mut self, count: usize) -> Result<&[u8], String> {
        let end = self.position.checked_add(count).ok_or(INCOMPLETE)?;
        let bytes = self.data.get(self.position..end).ok_or(INCOMPLETE)?;
        self.position = end;
        Ok(bytes)
    }

    fn align(&mut self, size: usize) {
        self.position = (self.position + self.offset).next_multiple_of(size) - self.offset;
    }

    fn aligned<const N: usize>(&mut self) -> Result<[u8; N], String> {
        self.align(N);
        let bytes = self.take(N)?;
        bytes.try_into().map_err(|_| INCOMPLETE.to_owned())
    }

    fn length(&mut self) -> Result<usize, String> {
        let length = u32::from_le_bytes(self.aligned()?) as usize;
        // Each element takes at least one byte.
        if length > self.data.len() { Err(INCOMPLETE.to_owned()) } else { Ok(length) }
    }

    fn structure(&mut self, structure: &Structure, path: &[Part]) -> Result<Option<Value>, String> {
        let Some((Part::Field(name), rest)) = path.split_first() else { return Ok(None) };
        for field in &structure.fields {
            if field.name == *name {
                return self.layout(&field.layout, rest);
            }
            self.skip(&field.layout)?;
        }
        Ok(None)
    }

    fn layout(&mut self, layout: &Layout, path: &[Part]) -> Result<Option<Value>, String> {
        match (layout, path.split_first()) {
            (Layout::Single(primitive), None) => self.primitive(*primitive).map(Some),
            (Layout::Text { .. }, None) => {
                let length = self.length()?;
                let bytes = self.take(length)?;
                let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
                Ok(Some(String::from_utf8_lossy(bytes).into()))
            }
            (Layout::Structure(inner), _) => self.structure(inner, path),
            (Layout::Array(element, size), Some((Part::Index(index), rest))) => {
                self.element(element, *size as usize, *index, rest)
            }
            (Layout::Sequence { element, .. }, Some((Part::Index(index), rest))) => {
                let length = self.length()?;
                self.element(element, length, *index, rest)
            }
            // Other combinations do not occur, because paths are checked when the settings are read.
            _ => Ok(None),
        }
    }

    fn element(
        &mut self,
        element: &Layout,
        length: usize,
        index: usize,
        path: &[Part],
    ) -> Result<Option<Value>, String> {
        if index >= length {
            return Ok(None);
        }
        self.skip_several(element, index)?;
        self.layout(element, path)
    }

    fn primitive(&mut self, primitive: Primitive) -> Result<Value, String> {
        Ok(match primitive {
            Primitive::Bool => (self.aligned::<1>()? != [0]).into(),
            Primitive::Byte | Primitive::Char | Primitive::Uint8 => u8::from_le_bytes(self.aligned()?).into(),
            Primitive::Int8 => i8::from_le_bytes(self.aligned()?).into(),
            Primitive::Int16 => i16::from_le_bytes(self.aligned()?).into(),
            Primitive::Uint16 => u16::from_le_bytes(self.aligned()?).into(),
            Primitive::Int32 => i32::from_le_bytes(self.aligned()?).into(),
            Primitive::Uint32 => u32::from_le_bytes(self.aligned()?).into(),
            Primitive::Int64 => i64::from_le_bytes(self.aligned()?).into(),
            Primitive::Uint64 => u64::from_le_bytes(self.aligned()?).into(),
            Primitive::Float32 => float(f32::from_le_bytes(self.aligned()?)),
            Primitive::Float64 => float(f64::from_le_bytes(self.aligned()?)),
            Primitive::String => return Err(INCOMPLETE.to_owned()),
        })
    }

    fn skip(&mut self, layout: &Layout) -> Result<(), String> {
        match layout {
            Layout::Single(_) => self.skip_several(layout, 1),
            Layout::Text { .. } => {
                let length = self.length()?;
                self.take(length).map(|_| ())
            }
            Layout::Structure(inner) => inner.fields.iter().try_for_each(|field| self.skip(&field.layout)),
            Layout::Array(element, size) => self.skip_several(element, *size as usize),
            Layout::Sequence { element, .. } => {
                let length = self.length()?;
                self.skip_several(element, length)
            }
        }
    }

    fn skip_several(&mut self, layout: &Layout, count: usize) -> Result<(), String> {
        let Layout::Single(primitive) = layout else {
            return (0..count).try_for_each(|_| self.skip(layout));
        };
        if count == 0 {
            return Ok(());
        }
        let size = primitive.size();
        self.align(size);
        self.take(count.checked_mul(size).ok_or(INCOMPLETE)?).map(|_| ())
    }
}

/// Converts a floating-point number, so that equal numbers have equal values: zero without a sign.
fn float<F: Copy + Into<f64> + Into<Value>>(number: F) -> Value {
    let double: f64 = number.into();
    if double == 0.0 {
        Value::from(0.0)
    } else if double.is_infinite() {
        Value::from(if double > 0.0 { "inf" } else { "-inf" })
    } else {
        number.into()
    }
}

impl Primitive {
    /// Size and alignment of a number or truth value, in bytes.
    fn size(self) -> usize {
        match self {
            Self::Bool | Self::Byte | Self::Char | Self::Int8 | Self::Uint8 | Self::String => 1,
            Self::Int16 | Self::Uint16 => 2,
            Self::Int32 | Self::Uint32 | Self::Float32 => 4,
            Self::Int64 | Self::Uint64 | Self::Float64 => 8,
        }
    }
}
