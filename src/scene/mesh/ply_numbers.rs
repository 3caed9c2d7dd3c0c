//! The numbers after the header of a PLY file: text, or binary in either order of bytes.

use super::ply_header::Scalar;

/// Why a row cannot be read.
pub(super) enum RowFault {
    End,
    NotANumber,
    /// The length of a list.
    Negative,
    TooMany,
}

/// The numbers after the header.
pub(super) trait Numbers {
    /// The next number. All types of PLY fit into double precision.
    fn next(&mut self, scalar: Scalar) -> Result<f64, RowFault>;

    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), RowFault>;

    /// The current line of a text.
    fn line(&self) -> Option<usize>;
}

/// Numbers as text, with blanks between them.
pub(super) struct Text<'a> {
    pub(super) rest: &'a [u8],
    pub(super) line: usize,
}

impl<'a> Text<'a> {
    fn token(&mut self) -> Result<&'a [u8], RowFault> {
        let start = self.rest.iter().position(|b| {
            self.line += usize::from(*b == b'\n');
            !b.is_ascii_whitespace()
        });
        let rest = &self.rest[start.ok_or(RowFault::End)?..];
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        let (token, rest) = rest.split_at(end);
        self.rest = rest;
        Ok(token)
    }
}

impl Numbers for Text<'_> {
    #[inline]
    fn next(&mut self, scalar: Scalar) -> Result<f64, RowFault> {
        let token = std::str::from_utf8(self.token()?).map_err(|_| RowFault::NotANumber)?;
        let number = match scalar {
            Scalar::F32 => token.parse::<f32>().map(f64::from),
            _ => token.parse(),
        };
        number.map_err(|_| RowFault::NotANumber)
    }

    fn skip(&mut self, _: Scalar, count: usize) -> Result<(), RowFault> {
        (0..count).try_for_each(|_| self.token().map(|_| ()))
    }

    fn line(&self) -> Option<usize> {
        Some(self.line)
    }
}

/// Binary numbers, the most significant byte first where `BIG`.
pub(super) struct Binary<'a, const BIG: bool> {
    pub(super) rest: &'a [u8],
}

impl<const BIG: bool> Numbers for Binary<'_, BIG> {
    #[inline]
    fn next(&mut self, scalar: Scalar) -> Result<f64, RowFault> {
        macro_rules! take {
            ($type:ty) => {{
                let (bytes, rest) = self.rest.split_first_chunk().ok_or(RowFault::End)?;
                self.rest = rest;
                f64::from(if BIG { <$type>::from_be_bytes(*bytes) } else { <$type>::from_le_bytes(*bytes) })
            }};
        }
        Ok(match scalar {
            Scalar::I8 => take!(i8),
            Scalar::U8 => take!(u8),
            Scalar::I16 => take!(i16),
            Scalar::U16 => take!(u16),
            Scalar::I32 => take!(i32),
            Scalar::U32 => take!(u32),
            Scalar::F32 => take!(f32),
            Scalar::F64 => take!(f64),
        })
    }

    fn skip(&mut self, scalar: Scalar, count: usize) -> Result<(), RowFault> {
        self.rest =
            count.checked_mul(scalar.bytes()).and_then(|n| self.rest.get(n..)).ok_or(RowFault::End)?;
        Ok(())
    }

    fn line(&self) -> Option<usize> {
        None
    }
}
