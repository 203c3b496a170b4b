//! Parquet files with columns compressed by zstd, whose pages are decompressed here.
//!
//! The `zstd` feature of the crate `parquet` needs a C compiler. A compressed column is therefore read as if
//! it were not compressed, and its pages are decompressed by a decoder in Rust.

use std::io::Read;
use std::sync::Arc;

use bytes::Bytes;
use parquet::basic::Compression;
use parquet::bloom_filter::Sbbf;
use parquet::column::page::{Page, PageMetadata, PageReader};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::{ParquetMetaData, ParquetMetaDataReader, RowGroupMetaData};
use parquet::file::reader::{ChunkReader, FileReader, RowGroupReader};
use parquet::file::serialized_reader::SerializedPageReader;
use parquet::record::reader::RowIter;
use parquet::schema::types::Type;
use ruzstd::decoding::StreamingDecoder;

/// Most bytes of a decompressed page: writers make pages of about one MiB.
const MOST: u64 = 256 << 20;

/// Parquet file, read column by column; columns by zstd are decompressed here, others by the crate `parquet`.
pub(crate) struct ParquetFile<R: ChunkReader> {
    chunks: Arc<R>,
    metadata: ParquetMetaData,
}

impl<R: ChunkReader + 'static> ParquetFile<R> {
    /// Reads the footer of `chunks`.
    ///
    /// # Errors
    /// [`ParquetError`] for a footer that is not one of Parquet.
    pub(crate) fn new(chunks: R) -> Result<Self> {
        let metadata = ParquetMetaDataReader::new().parse_and_finish(&chunks)?;
        Ok(Self { chunks: Arc::new(chunks), metadata })
    }
}

impl<R: ChunkReader + 'static> FileReader for ParquetFile<R> {
    fn metadata(&self) -> &ParquetMetaData {
        &self.metadata
    }

    fn num_row_groups(&self) -> usize {
        self.metadata.num_row_groups()
    }

    fn get_row_group(&self, i: usize) -> Result<Box<dyn RowGroupReader + '_>> {
        let group = self.metadata.row_groups().get(i);
        let group = group.ok_or_else(|| ParquetError::General(format!("no row group {i}")))?;
        Ok(Box::new(RowGroup { chunks: Arc::clone(&self.chunks), metadata: group }))
    }

    fn get_row_iter(&self, projection: Option<Type>) -> Result<RowIter<'_>> {
        RowIter::from_file(projection, self)
    }
}

struct RowGroup<'f, R: ChunkReader> {
    chunks: Arc<R>,
    metadata: &'f RowGroupMetaData,
}

impl<R: ChunkReader + 'static> RowGroupReader for RowGroup<'_, R> {
    fn metadata(&self) -> &RowGroupMetaData {
        self.metadata
    }

    fn num_columns(&self) -> usize {
        self.metadata.num_columns()
    }

    fn get_column_page_reader(&self, i: usize) -> Result<Box<dyn PageReader>> {
        let column = self.metadata.column(i);
        let rows = usize::try_from(self.metadata.num_rows())?;
        let chunks = Arc::clone(&self.chunks);
        if !matches!(column.compression(), Compression::ZSTD(_)) {
            return Ok(Box::new(SerializedPageReader::new(chunks, column, rows, None)?));
        }
        let plain = column.clone().into_builder().set_compression(Compression::UNCOMPRESSED).build()?;
        Ok(Box::new(ZstdPages { compressed: SerializedPageReader::new(chunks, &plain, rows, None)? }))
    }

    fn get_column_bloom_filter(&self, _: usize) -> Option<&Sbbf> {
        None
    }

    fn get_row_iter(&self, projection: Option<Type>) -> Result<RowIter<'_>> {
        RowIter::from_row_group(projection, self)
    }
}

/// Pages of a column by zstd, decompressed.
struct ZstdPages<R: ChunkReader> {
    compressed: SerializedPageReader<R>,
}

impl<R: ChunkReader> Iterator for ZstdPages<R> {
    type Item = Result<Page>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

impl<R: ChunkReader> PageReader for ZstdPages<R> {
    fn get_next_page(&mut self) -> Result<Option<Page>> {
        self.compressed.get_next_page()?.map(page).transpose()
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>> {
        self.compressed.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<()> {
        self.compressed.skip_next_page()
    }
}

/// Page with its bytes decompressed: for version 2 those behind the levels, unless the page is marked as not
/// compressed.
fn page(mut page: Page) -> Result<Page> {
    match &mut page {
        Page::DataPage { buf, .. } | Page::DictionaryPage { buf, .. } => *buf = plain(buf, 0)?,
        Page::DataPageV2 { buf, def_levels_byte_len, rep_levels_byte_len, is_compressed, .. } => {
            if std::mem::take(is_compressed) {
                *buf = plain(buf, *def_levels_byte_len as usize + *rep_levels_byte_len as usize)?;
            }
        }
    }
    Ok(page)
}

/// Decompressed bytes of a page, whose first `levels` bytes are not compressed.
fn plain(bytes: &Bytes, levels: usize) -> Result<Bytes> {
    let wrong = |e: &dyn std::fmt::Display| ParquetError::General(format!("a page by zstd: {e}"));
    if levels > bytes.len() {
        return Err(wrong(&"it is shorter than its levels"));
    }
    let (mut out, compressed) = (bytes[..levels].to_vec(), &bytes[levels..]);
    // a page without values may have no frame
    if !compressed.is_empty() {
        let decoder = StreamingDecoder::new(compressed).map_err(|e| wrong(&e))?;
        let found = decoder.take(MOST + 1).read_to_end(&mut out).map_err(|e| wrong(&e))?;
        if found as u64 > MOST {
            return Err(wrong(&format!("more than {} MiB; expected smaller pages", MOST >> 20)));
        }
    }
    Ok(out.into())
}

#[cfg(test)]
mod tests {
    use parquet::record::RowAccessor;

    use super::*;

    /// Rows of files by pyarrow equal those of a formula: tests/data/README.md.
    #[test]
    fn rows_are_those_of_another_writer() {
        let files: [&[u8]; 2] =
            [include_bytes!("../tests/data/zstd-1.parquet"), include_bytes!("../tests/data/zstd-2.parquet")];
        for bytes in files {
            let file = ParquetFile::new(Bytes::from_static(bytes)).expect("a footer");
            assert_eq!(file.num_row_groups(), 2);
            let columns = || file.metadata().row_groups().iter().flat_map(|g| g.columns());
            assert!(columns().all(|c| matches!(c.compression(), Compression::ZSTD(_))));
            let mut rows = 0_u64;
            for (k, row) in (0_u64..).zip(file.get_row_iter(None).expect("rows")) {
                let row = row.expect("a row");
                assert_eq!(row.get_double(0).expect("a time"), k as f64 / 2.0);
                assert_eq!(row.get_string(1).expect("a label"), if k < 1000 { "p1" } else { "p2" });
                let force = (k % 97 != 0).then_some((k * k % 1009) as f64 / 1024.0);
                assert_eq!(row.get_double(2).ok(), force, "row {k}");
                rows += 1;
            }
            assert_eq!(rows, 2000);
        }
    }

    /// Invalid or truncated frames give an error and no panic.
    #[test]
    fn damaged_pages_are_refused() {
        let bytes: &[u8] = include_bytes!("../tests/data/zstd-1.parquet");
        let wrong = |bytes: Vec<u8>| {
            let file = ParquetFile::new(Bytes::from(bytes)).expect("a footer");
            file.get_row_iter(None).map_or(1, |rows| rows.filter(Result::is_err).take(1).count())
        };
        // the magic number of the first frame
        let magic = [0x28, 0xb5, 0x2f, 0xfd];
        let at = bytes.windows(4).position(|w| w == magic).expect("a frame");
        let mut other = bytes.to_vec();
        other[at] = 0;
        assert_eq!(wrong(other), 1);
        assert!(plain(&Bytes::from_static(&[1, 2]), 3).is_err());
        let frame = Bytes::copy_from_slice(&bytes[at..at + 12]);
        assert!(plain(&frame, 0).is_err());
    }
}
