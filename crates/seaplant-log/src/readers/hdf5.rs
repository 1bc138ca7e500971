//! HDF5 files: MATLAB 7.3, and others whose datasets are columns.

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use hdf5_pure::{AttrValue, DType, Dataset, File, Group, Layout, ReadSeekSource};

use crate::assemble::Assembly;
use crate::content::Content;
use crate::note::Note;
use crate::readers::workspace::{
    CELLS, COMPLEX, DEEP, DEEPEST, EMPTY, FUNCTION, OBJECT, SPARSE, STRUCTS, TEXT, Workspace,
};
use crate::unpack::limit;
use crate::{Error, Log, ReadOptions, Unit};

/// Name of the format in messages.
const FORMAT: &str = "an HDF5 file or a MATLAB 7.3 file";

const UNREADABLE: &str = "is damaged, or stored in a way of HDF5 that is not known: save it again, by \
     a later version of MATLAB or with -v7";

/// Returns whether bytes start like an HDF5 file, which may have a block of another kind in front:
/// MATLAB's has 512 bytes.
pub(crate) fn recognises(head: &[u8]) -> bool {
    const MARK: &[u8] = b"\x89HDF\r\n\x1a\n";
    let marked = |at: usize| head.get(at..).is_some_and(|rest| rest.starts_with(MARK));
    [0, 512, 1024, 2048].into_iter().any(marked) || head.starts_with(b"MATLAB 7.3")
}

/// Reads an HDF5 file.
///
/// # Errors
/// [`Error::Io`]; [`Error::Damaged`] of a file whose groups cannot be found, as when it is cut off;
/// [`Error::Unsupported`] of NetCDF; those of [`Workspace::log`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    let is_matlab = content.head().starts_with(b"MATLAB");
    let (origin, stream) = content.seekable()?;
    // The library panics on some numbers of a damaged file.
    let walked = catch_unwind(AssertUnwindSafe(|| {
        let file = File::from_source(ReadSeekSource::new(stream)?)?;
        let mut walk = Walk::new(&file);
        if walk.is_netcdf()? {
            return Ok(None);
        }
        walk.group(&file.root(), "", 0)?;
        let cut = file.superblock().eof_address > file.file_size();
        Ok(Some((walk.workspace, cut.then(|| file.file_size()))))
    }));
    let damaged = |found| Error::Damaged { path: path.clone(), format: FORMAT, found };
    let walked: Result<_, hdf5_pure::Error> =
        walked.map_err(|_| damaged("its parts contradict each other".to_owned()))?;
    let Some((workspace, cut)) = walked.map_err(|error| damaged(error.to_string()))? else {
        let (detail, advice) = ("of NetCDF".to_owned(), "export its variables as CSV");
        return Err(Error::Unsupported { path, format: "an HDF5 file", detail, advice });
    };
    let mut assembly = Assembly::new(origin, options);
    if let Some(byte) = cut {
        assembly.note(Note::Truncated { path: path.clone(), byte, last_s: None });
    }
    workspace.log(assembly, options, &path, if is_matlab { "MATLAB 7.3" } else { "HDF5" })
}

/// Traversal of the groups of a file.
struct Walk<'a> {
    file: &'a File,
    workspace: Workspace,
    /// Number of groups and datasets that may still be visited: links can form a cycle.
    objects: u64,
    /// Number of bytes that datasets may still hold.
    bytes: u64,
}

impl<'a> Walk<'a> {
    fn new(file: &'a File) -> Self {
        /// Minimum size of a group or dataset.
        const OBJECT_BYTES: u64 = 32;
        let size = file.file_size();
        let (objects, bytes) = (size / OBJECT_BYTES, limit(size));
        Self { file, workspace: Workspace::default(), objects, bytes }
    }

    fn is_netcdf(&self) -> Result<bool, hdf5_pure::Error> {
        Ok(self.file.root().attrs()?.contains_key("_NCProperties"))
    }

    /// Reads the content of a group called `name`, which is empty for the root.
    fn group(&mut self, group: &Group, name: &str, depth: usize) -> Result<(), hdf5_pure::Error> {
        let member = |member: String| match name {
            "" => member,
            _ => format!("{name}.{member}"),
        };
        for (name, dataset) in group.iter_datasets()? {
            let name = member(name);
            // If one is damaged, the others may be intact.
            if self.may_look() && self.dataset(&dataset, &name).is_err() {
                self.workspace.leave_out(name, UNREADABLE);
            }
        }
        for (name, group) in group.iter_groups()?.filter(|(name, _)| !is_hidden(name)) {
            if !self.may_look() {
                break;
            }
            let name = member(name);
            let Ok(attributes) = group.attrs() else {
                self.workspace.leave_out(name, UNREADABLE);
                continue;
            };
            let class = text(&attributes, "MATLAB_class");
            if attributes.contains_key("MATLAB_sparse") {
                self.workspace.leave_out(name, SPARSE);
            } else if let Some(why) = class.filter(|class| *class != "struct").map(why_not) {
                self.workspace.leave_out(name, why);
            } else if depth == DEEPEST {
                self.workspace.leave_out(name, DEEP);
            } else if self.group(&group, &name, depth + 1).is_err() {
                self.workspace.leave_out(name, UNREADABLE);
            }
        }
        Ok(())
    }

    fn may_look(&mut self) -> bool {
        self.objects = self.objects.saturating_sub(1);
        self.objects > 0
    }

    fn dataset(&mut self, dataset: &Dataset, name: &str) -> Result<(), hdf5_pure::Error> {
        let attributes = dataset.attrs()?;
        let class = text(&attributes, "MATLAB_class");
        let kind = dataset.dtype()?;
        let is_mask = matches!(kind, DType::Enum(_)) && dataset.element_size()? == 1;
        let why = match class {
            _ if attributes.contains_key("MATLAB_empty") => Some(EMPTY),
            Some(class) if !NUMERIC.contains(&class) => Some(why_not(class)),
            _ if is_mask => None,
            _ => not_numbers(&kind),
        };
        let why = if why.is_none() { self.too_much(dataset)? } else { why };
        if let Some(why) = why {
            self.workspace.leave_out(name.to_owned(), why);
            return Ok(());
        }
        let mut values = match is_mask {
            true => dataset.read_raw()?.into_iter().map(f64::from).collect(),
            false => dataset.read_f64()?,
        };
        let mut shape: Vec<usize> = dataset.shape()?.into_iter().map(|n| n as usize).collect();
        match class {
            // MATLAB reverses the dimensions, so that columns are contiguous.
            Some(_) => shape.reverse(),
            None => values = column_after_column(&shape, values),
        }
        let unit = text(&attributes, "units").and_then(Unit::find);
        self.workspace.add(name.to_owned(), unit, &shape, values);
        Ok(())
    }

    /// Returns why a dataset is not read, if it claims more than is stored: unwritten chunks would
    /// read as zeros.
    fn too_much(&mut self, dataset: &Dataset) -> Result<Option<&'static str>, hdf5_pure::Error> {
        /// Maximum compression ratio of deflate.
        const DEFLATE: u64 = 1032;
        let (shape, size) = (dataset.shape()?, self.file.file_size());
        let stored = match dataset.layout()? {
            Layout::Compact { size } => size,
            Layout::Contiguous { address: Some(_), size: stored } => stored.min(size),
            Layout::Chunked { chunk_shape, .. } => {
                let chunks = dataset.chunks()?;
                if chunks.len() as u64 != grid(&shape, &chunk_shape) {
                    return Ok(Some("was not written, or in part only"));
                }
                let stored = chunks.iter().map(|chunk| chunk.storage_size);
                let packed = if dataset.filters().is_empty() { 1 } else { DEFLATE };
                stored.fold(0, u64::saturating_add).min(size).saturating_mul(packed)
            }
            _ => return Ok(Some("was not written, or in part only")),
        };
        let count = shape.iter().try_fold(1_u64, |product, &length| product.checked_mul(length));
        let element = dataset.element_size()?;
        let claimed = count.and_then(|count| count.checked_mul(element));
        // Numbers are widened to doubles, whatever their size in the file.
        let doubles = count.and_then(|count| count.checked_mul(8));
        Ok(match (claimed, doubles) {
            (Some(0), _) => Some(EMPTY),
            (Some(claimed), Some(doubles)) if claimed <= stored && doubles <= self.bytes => {
                self.bytes -= doubles;
                None
            }
            _ => Some("claims more numbers than its file can hold"),
        })
    }
}

/// Returns the number of chunks of a dataset.
fn grid(shape: &[u64], chunk: &[u64]) -> u64 {
    let along = shape.iter().zip(chunk).map(|(&length, &chunk)| length.div_ceil(chunk.max(1)));
    along.fold(1, u64::saturating_mul)
}

/// Returns whether a name is internal to MATLAB, such as the targets of cell references.
fn is_hidden(name: &str) -> bool {
    name.starts_with('#')
}

fn text<'a>(attributes: &'a HashMap<String, AttrValue>, name: &str) -> Option<&'a str> {
    attributes.get(name)?.as_str()
}

/// MATLAB's numeric classes.
const NUMERIC: &[&str] = &[
    "double", "single", "logical", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64",
    "uint64",
];

/// Returns why a variable of one of MATLAB's other classes is left out.
fn why_not(class: &str) -> &'static str {
    match class {
        "cell" => CELLS,
        "char" => TEXT,
        "struct" => STRUCTS,
        "function_handle" => FUNCTION,
        _ => OBJECT,
    }
}

/// Returns why a data type is not numeric, if it is not.
fn not_numbers(kind: &DType) -> Option<&'static str> {
    match kind {
        DType::F32 | DType::F64 | DType::I8 | DType::I16 | DType::I32 | DType::I64 => None,
        DType::U8 | DType::U16 | DType::U32 | DType::U64 => None,
        DType::String | DType::VariableLengthString => Some(TEXT),
        DType::ObjectReference => Some(STRUCTS),
        DType::Compound(members) if members.len() == 2 && members[0].0 == "real" => Some(COMPLEX),
        _ => Some("is not numeric"),
    }
}

/// Transposes a row-major matrix to column-major order.
fn column_after_column(shape: &[usize], values: Vec<f64>) -> Vec<f64> {
    match *shape {
        [rows, columns] if rows > 1 && columns > 1 && values.len() == rows * columns => {
            (0..columns).flat_map(|k| values[k..].iter().step_by(columns).copied()).collect()
        }
        _ => values,
    }
}
