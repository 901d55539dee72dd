//! A ZIP archive of members as they are, as `numpy.savez` writes it.
//!
//! The writer of the crate `zip` prints to standard error when a disk is full; this one returns the
//! error, and needs no seeking. Layout: PKWARE's APPNOTE 6.3, with the ZIP64 fields of its §4.5.3 where
//! a size needs them.

use std::io::{self, Write};

use flate2::Crc;

const LIMIT: u64 = u32::MAX as u64;
/// Midnight of 1 January 1980, the earliest: the time would make equal input give other bytes.
const DATE: u16 = 0x21;

/// What the directory at the end says of a member.
struct Member {
    name: String,
    crc: u32,
    size: u64,
    offset: u64,
}

/// An archive that is being written.
pub(super) struct Archive<W> {
    out: W,
    written: u64,
    members: Vec<Member>,
}

impl<W: Write> Archive<W> {
    pub fn new(out: W) -> Self {
        Self {
            out,
            written: 0,
            members: Vec::new(),
        }
    }

    /// Adds a member. `content` is called twice: its length and check sum stand before it.
    pub fn add(
        &mut self,
        name: &str,
        content: impl Fn(&mut dyn Write) -> io::Result<()>,
    ) -> io::Result<()> {
        let mut sum = Sum::default();
        content(&mut sum)?;
        let member = Member {
            name: name.into(),
            crc: sum.crc.sum(),
            size: sum.size,
            offset: self.written,
        };
        self.put(&member.local_header())?;
        content(&mut self.out)?;
        self.written += member.size;
        self.members.push(member);
        Ok(())
    }

    /// Writes the directory.
    pub fn finish(mut self) -> io::Result<()> {
        let start = self.written;
        for member in std::mem::take(&mut self.members) {
            self.put(&member.directory_entry())?;
            self.members.push(member);
        }
        let (size, end) = (self.written - start, self.written);
        let count = self.members.len() as u64;
        if start >= LIMIT {
            self.put(&zip64_end(count, size, start, end))?;
        }
        let mut record = Record::new(0x0605_4b50);
        record.u16(0).u16(0).u16(count as u16).u16(count as u16);
        record
            .u32(size.min(LIMIT) as u32)
            .u32(start.min(LIMIT) as u32)
            .u16(0);
        self.put(&record.0)
    }

    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.written += bytes.len() as u64;
        self.out.write_all(bytes)
    }
}

impl Member {
    fn local_header(&self) -> Vec<u8> {
        let mut extra = Record(Vec::new());
        if self.size >= LIMIT {
            extra.u16(1).u16(16).u64(self.size).u64(self.size);
        }
        let mut record = Record::new(0x0403_4b50);
        self.common_fields(&mut record);
        record
            .u16(extra.0.len() as u16)
            .bytes(self.name.as_bytes())
            .bytes(&extra.0);
        record.0
    }

    fn directory_entry(&self) -> Vec<u8> {
        let mut fields = Record(Vec::new());
        if self.size >= LIMIT {
            fields.u64(self.size).u64(self.size);
        }
        if self.offset >= LIMIT {
            fields.u64(self.offset);
        }
        let mut extra = Record(Vec::new());
        if !fields.0.is_empty() {
            extra.u16(1).u16(fields.0.len() as u16).bytes(&fields.0);
        }
        let mut record = Record::new(0x0201_4b50);
        record.u16(45);
        self.common_fields(&mut record);
        // No comment, first disk, no attributes.
        record.u16(extra.0.len() as u16).u16(0).u16(0).u16(0).u32(0);
        record.u32(self.offset.min(LIMIT) as u32);
        record.bytes(self.name.as_bytes()).bytes(&extra.0);
        record.0
    }

    /// Version 4.5, names in UTF-8, stored, the date, the sum, the sizes, the name's length.
    fn common_fields(&self, record: &mut Record) {
        let size = self.size.min(LIMIT) as u32;
        record.u16(45).u16(1 << 11).u16(0).u16(0).u16(DATE);
        record
            .u32(self.crc)
            .u32(size)
            .u32(size)
            .u16(self.name.len() as u16);
    }
}

/// The end of a directory that begins beyond 4 GiB, and where to find it.
fn zip64_end(count: u64, size: u64, start: u64, end: u64) -> Vec<u8> {
    let mut record = Record::new(0x0606_4b50);
    record.u64(44).u16(45).u16(45).u32(0).u32(0);
    record.u64(count).u64(count).u64(size).u64(start);
    record.u32(0x0706_4b50).u32(0).u64(end).u32(1);
    record.0
}

/// Little-endian fields, one after another.
struct Record(Vec<u8>);

impl Record {
    fn new(signature: u32) -> Self {
        Self(signature.to_le_bytes().to_vec())
    }

    fn u16(&mut self, value: u16) -> &mut Self {
        self.bytes(&value.to_le_bytes())
    }

    fn u32(&mut self, value: u32) -> &mut Self {
        self.bytes(&value.to_le_bytes())
    }

    fn u64(&mut self, value: u64) -> &mut Self {
        self.bytes(&value.to_le_bytes())
    }

    fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.0.extend_from_slice(bytes);
        self
    }
}

/// Counts and sums what is written to it.
#[derive(Default)]
struct Sum {
    crc: Crc,
    size: u64,
}

impl Write for Sum {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.crc.update(bytes);
        self.size += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
