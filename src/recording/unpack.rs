//! Decompresses the chunks of MCAP files to records.

use std::io::{self, Read as _};

use mcap::read::ChunkReader;
use mcap::records::{ChunkHeader, Record};

/// Maximum size of a record or an uncompressed chunk, in bytes.
pub(super) const LARGEST: usize = 1 << 28;

pub(super) fn records(header: &ChunkHeader, data: &[u8]) -> io::Result<Vec<Record<'static>>> {
    let size = usize::try_from(header.uncompressed_size).unwrap_or(usize::MAX);
    if size > LARGEST {
        return Err(io::Error::other(format!("a chunk of {size} bytes is too large")));
    }
    let mut plain = vec![0; size];
    let written = match header.compression.as_str() {
        "" => io::copy(&mut data.take(size as u64), &mut plain.as_mut_slice())? as usize,
        "zstd" => {
            ruzstd::decoding::FrameDecoder::new().decode_all(data, &mut plain).map_err(io::Error::other)?
        }
        "lz4" => {
            let mut decoder = lz4_flex::frame::FrameDecoder::new(data);
            decoder.read_exact(&mut plain)?;
            size
        }
        other => {
            return Err(io::Error::other(format!(
                "there is no compression `{other}`; there are zstd and lz4"
            )));
        }
    };
    if written != size {
        return Err(io::Error::other(format!("a chunk has {written} bytes in place of {size}")));
    }
    let header = ChunkHeader {
        compression: String::new(),
        compressed_size: header.uncompressed_size,
        ..header.clone()
    };
    let records = ChunkReader::new(header, &plain).map_err(io::Error::other)?;
    records.map(|record| record.map(Record::into_owned).map_err(io::Error::other)).collect()
}
