// Runs the program on a folder in memory, away from the page, which stays quick meanwhile.
"use strict";

let loaded;

// The program from its text within the page: base64 of LZMA.
function compiled(text) {
  const letters = atob(text);
  const packed = Uint8Array.from(letters, (letter) => letter.charCodeAt(0));
  return WebAssembly.compile(unpacked(packed));
}

function laid(files) {
  const root = new Folder();
  for (const { path, text, bytes, file } of files) {
    if (file) put(root, path, new Disk(file));
    else put(root, path, new Bytes(bytes ?? new TextEncoder().encode(text)));
  }
  return root;
}

// Runs commands one after the other on the same files, and gives what they print and leave.
function work(program, { files, commands, collect }, tell) {
  const root = laid(files);
  const total = files.reduce((sum, { file }) => sum + (file?.size ?? 0), 0);
  let read = 0;
  let before = 0;
  const seen = (bytes) => {
    read += bytes;
    if (read - before < 1 << 20) return;
    before = read;
    tell({ read, total });
  };
  const hear = (line) => {
    if (line.startsWith('{"axes"')) tell({ fit: JSON.parse(line) });
  };
  const results = [];
  for (const [k, words] of commands.entries()) {
    tell({ command: words[0], number: k + 1, of: commands.length });
    const system = new System(root, ["seaplant", ...words], { hear, seen });
    let result;
    try {
      result = system.run(program);
    } catch (error) {
      const said = `${error.said ?? ""}\n${error.message}`;
      result = { code: 134, printed: "", said, broken: true, reading: system.reading };
    }
    results.push(result);
  }
  const left = [];
  for (const path of collect) {
    for (const [name, node] of filesBelow(root, path)) {
      if (node instanceof Bytes) left.push({ path: name, bytes: node.content() });
    }
  }
  return { results, left };
}

self.onmessage = async ({ data }) => {
  try {
    if (data.program) {
      loaded = typeof data.program === "string" ? compiled(data.program) : data.program;
      self.postMessage({ ready: await loaded });
      return;
    }
    // What is asked for meanwhile waits for the program.
    const done = work(await loaded, data, (progress) => self.postMessage({ id: data.id, progress }));
    self.postMessage({ id: data.id, done }, done.left.map(({ bytes }) => bytes.buffer));
  } catch (error) {
    self.postMessage({ id: data.id, failed: String(error.message ?? error) });
  }
};
