//! XML tree of a VTK file; the text of arrays stays in the file's bytes.

use std::ops::Range;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use crate::error::{Error, Location};
use crate::limits::Memory;
use crate::source::Input;

/// Limit of the nesting; VTK nests six deep.
const MAX_DEPTH: usize = 32;

/// Limit of the attributes of an element, which the parser compares with each other; VTK writes about ten.
const MAX_ATTRIBUTES: usize = 128;

/// An XML element.
#[derive(Debug, Default)]
pub(super) struct Node {
    pub name: String,
    attributes: Vec<(String, String)>,
    pub children: Vec<Node>,
    /// Byte range of the text from the opening tag to the first child or the closing tag.
    pub text: Range<usize>,
    /// Byte offset of the element.
    pub byte: usize,
}

/// Content of `<AppendedData>`: the bytes after the underscore, base64 up to the closing tag.
#[derive(Debug)]
pub(super) struct Appended {
    pub range: Range<usize>,
    pub base64: bool,
}

impl Node {
    pub fn attribute(&self, name: &str) -> Option<&str> {
        let mut attributes = self.attributes.iter();
        attributes
            .find(|(key, _)| key == name)
            .map(|(_, value)| value.as_str())
    }

    pub fn child(&self, name: &str) -> Option<&Node> {
        self.children.iter().find(|child| child.name == name)
    }

    pub fn children_named<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Node> {
        self.children.iter().filter(move |child| child.name == name)
    }
}

/// Parses the tree of a file. Parsing stops at `<AppendedData>`, which may hold raw bytes.
pub(super) fn parse(input: &Input) -> Result<(Node, Option<Appended>), Error> {
    let memory = &input.memory;
    let mut reader = Reader::from_reader(input.bytes);
    reader.config_mut().check_end_names = true;
    let mut stack = vec![Node::default()];
    let mut appended = None;
    loop {
        let byte = reader.buffer_position() as usize;
        let bad = |problem: String| input.error(Location::Byte(byte), problem);
        let event = reader
            .read_event()
            .map_err(|e| bad(format!("broken XML: {e}; write the file again")))?;
        let after = reader.buffer_position() as usize;
        match event {
            Event::Start(tag) if tag.name().as_ref() == "AppendedData" => {
                appended = Some(find_appended(input, &tag, after).map_err(bad)?);
                break;
            }
            Event::Start(tag) => {
                if stack.len() > MAX_DEPTH {
                    return Err(bad("the XML is nested too deeply for a VTK file".into()));
                }
                let mut node = element(memory, &tag, byte).map_err(bad)?;
                node.text = after..after;
                end_text(&mut stack, byte);
                stack.push(node);
            }
            Event::Empty(tag) => {
                let node = element(memory, &tag, byte).map_err(bad)?;
                end_text(&mut stack, byte);
                attach(memory, &mut stack, node).map_err(bad)?;
            }
            Event::End(_) => {
                if let Some(mut node) = (stack.len() > 1).then(|| stack.pop()).flatten() {
                    if node.children.is_empty() {
                        node.text.end = byte.max(node.text.start);
                    }
                    attach(memory, &mut stack, node).map_err(bad)?;
                }
            }
            Event::Eof if stack.len() > 1 => {
                return Err(bad(
                    "the XML ends inside an element; the file is cut short".into()
                ));
            }
            Event::Eof => break,
            _ => {}
        }
    }
    // Elements left open at <AppendedData>.
    while stack.len() > 1 {
        let node = stack.pop().unwrap_or_default();
        attach(memory, &mut stack, node)
            .map_err(|problem| input.error(Location::Whole, problem))?;
    }
    Ok((stack.pop().unwrap_or_default(), appended))
}

/// The text of an element ends where its first child begins.
fn end_text(stack: &mut [Node], byte: usize) {
    if let Some(parent) = stack.last_mut().filter(|parent| parent.children.is_empty()) {
        parent.text.end = byte.max(parent.text.start);
    }
}

fn attach(memory: &Memory, stack: &mut [Node], node: Node) -> Result<(), String> {
    if let Some(parent) = stack.last_mut() {
        memory.make_room(&mut parent.children, 1)?;
        parent.children.push(node);
    }
    Ok(())
}

fn element(memory: &Memory, tag: &BytesStart, byte: usize) -> Result<Node, String> {
    // The name, and the texts of the attributes.
    memory.reserve(tag.len())?;
    let mut node = Node {
        name: tag.name().as_ref().to_string(),
        byte,
        ..Node::default()
    };
    for attribute in tag.attributes() {
        let attribute = attribute.map_err(|e| format!("broken XML: {e}; write the file again"))?;
        if node.attributes.len() == MAX_ATTRIBUTES {
            return Err(format!(
                "<{}> has more than {MAX_ATTRIBUTES} attributes; write the file again",
                node.name
            ));
        }
        memory.make_room(&mut node.attributes, 1)?;
        node.attributes.push((
            attribute.key.as_ref().to_string(),
            attribute.value.into_owned(),
        ));
    }
    Ok(node)
}

fn find_appended(input: &Input, tag: &BytesStart, after: usize) -> Result<Appended, String> {
    let node = element(&input.memory, tag, after)?;
    let rest = input.bytes.get(after..).unwrap_or_default();
    let underscore = memchr::memchr(b'_', rest)
        .filter(|&at| rest[..at].iter().all(u8::is_ascii_whitespace))
        .ok_or("the appended data do not begin with '_'")?;
    let base64 = node.attribute("encoding") == Some("base64");
    let start = after + underscore + 1;
    let data = input.bytes.get(start..).unwrap_or_default();
    let end = memchr::memchr(b'<', data).filter(|_| base64);
    Ok(Appended {
        range: start..start + end.unwrap_or(data.len()),
        base64,
    })
}
