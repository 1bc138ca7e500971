//! Writes MCAP files byte by byte, with content that independent writers do not produce.

/// A file under construction.
pub struct McapFile(Vec<u8>);

impl McapFile {
    pub fn new() -> Self {
        let mut file = Self(b"\x89MCAP0\r\n".to_vec());
        file.record(1, &[text("ros2"), text("test")].concat());
        file
    }

    pub fn record(&mut self, kind: u8, content: &[u8]) {
        self.0.push(kind);
        self.0.extend((content.len() as u64).to_le_bytes());
        self.0.extend(content);
    }

    /// Adds a topic, its type and its definition.
    pub fn topic(&mut self, id: u16, topic: &str, kind: &str, definition: &str) {
        self.channel(id, topic, kind, ("ros2msg", definition), "cdr");
    }

    pub fn channel(
        &mut self,
        id: u16,
        topic: &str,
        kind: &str,
        (language, definition): (&str, &str),
        encoding: &str,
    ) {
        let id = id.to_le_bytes().to_vec();
        let schema = [id.clone(), text(kind), text(language), text(definition)];
        self.record(3, &schema.concat());
        let none = vec![0; 4];
        self.record(4, &[id.clone(), id, text(topic), text(encoding), none].concat());
    }

    /// Adds a message received at `receipt` ns.
    pub fn message(&mut self, id: u16, receipt: u64, content: &[u8]) {
        let (sequence, receipt) = (vec![0; 4], receipt.to_le_bytes().to_vec());
        let head = [id.to_le_bytes().to_vec(), sequence, receipt.clone(), receipt].concat();
        self.record(5, &[&head, content].concat());
    }

    /// Adds a message in little-endian CDR, whose content is already aligned.
    pub fn cdr(&mut self, id: u16, receipt: u64, content: &[u8]) {
        self.message(id, receipt, &[&[0, 1, 0, 0], content].concat());
    }

    pub fn finish(mut self) -> Vec<u8> {
        self.record(15, &[0; 4]);
        self.record(2, &[0; 20]);
        self.0.extend(b"\x89MCAP0\r\n");
        self.0
    }
}

fn text(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
}
