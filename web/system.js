// A folder in memory, and the system calls (WASI preview 1) by which the program reads and writes
// it. Nothing else is within the program's reach: no disk, no network.
"use strict";

const OK = 0;
const BAD_DESCRIPTOR = 8;
const EXISTS = 20;
const INVALID = 28;
const IS_FOLDER = 31;
const NOT_THERE = 44;
const NO_SUCH_CALL = 52;
const NOT_A_FOLDER = 54;
const NOT_EMPTY = 55;
const NOT_PERMITTED = 63;

const FOLDER = 3;
const FILE = 4;
const CHARACTERS = 2;
const ROOT = 3;

// What is read of a large file at once.
const PIECE = 1 << 20;

class Exit extends Error {
  constructor(code) {
    super(`the program ended with ${code}`);
    this.code = code;
  }
}

let nodes = 0;

class Folder {
  constructor() {
    this.kind = FOLDER;
    this.id = ++nodes;
    this.entries = new Map();
  }
}

// Bytes that grow, as a file that is written.
class Bytes {
  constructor(bytes = new Uint8Array(0)) {
    this.kind = FILE;
    this.id = ++nodes;
    this.bytes = bytes;
    this.size = bytes.length;
  }

  read(at, most) {
    return this.bytes.subarray(at, Math.min(at + most, this.size));
  }

  resize(size) {
    if (size > this.bytes.length) {
      const grown = new Uint8Array(Math.max(size, 2 * this.bytes.length));
      grown.set(this.bytes.subarray(0, this.size));
      this.bytes = grown;
    }
    if (size > this.size) this.bytes.fill(0, this.size, size);
    this.size = size;
  }

  write(at, bytes) {
    if (at + bytes.length > this.size) this.resize(at + bytes.length);
    this.bytes.set(bytes, at);
  }

  content() {
    return this.bytes.slice(0, this.size);
  }
}

// A file on the user's disk, read piece by piece and never written.
class Disk {
  constructor(file) {
    this.kind = FILE;
    this.id = ++nodes;
    this.file = file;
    this.size = file.size;
    this.from = 0;
    this.piece = new Uint8Array(0);
  }

  read(at, most) {
    if (at >= this.size) return new Uint8Array(0);
    if (at < this.from || at >= this.from + this.piece.length) {
      const end = Math.min(this.size, at + Math.max(PIECE, most));
      this.piece = new Uint8Array(new FileReaderSync().readAsArrayBuffer(this.file.slice(at, end)));
      this.from = at;
    }
    return this.piece.subarray(at - this.from, at - this.from + most);
  }
}

// The steps of a path; `null` of one that leaves the folder.
function steps(path) {
  const walked = [];
  for (const step of path.split("/")) {
    if (step === "" || step === ".") continue;
    if (step !== "..") walked.push(step);
    else if (walked.pop() === undefined) return null;
  }
  return walked;
}

function find(root, path) {
  const walked = steps(path);
  if (walked === null) return undefined;
  let node = root;
  for (const step of walked) node = node?.entries?.get(step);
  return node;
}

// Puts a node at a path, with the folders that it lies in.
function put(root, path, node) {
  const walked = steps(path);
  const name = walked.pop();
  let folder = root;
  for (const step of walked) {
    if (!folder.entries.has(step)) folder.entries.set(step, new Folder());
    folder = folder.entries.get(step);
  }
  folder.entries.set(name, node);
}

// Every file below a path, by its path.
function* filesBelow(root, path) {
  const node = find(root, path);
  if (node === undefined) return;
  if (node.kind === FILE) yield [path, node];
  for (const name of node.entries?.keys() ?? []) yield* filesBelow(root, `${path}/${name}`);
}

class System {
  // `hear` gets each complete line of standard error; `seen` how many bytes were read.
  constructor(root, words, { hear = () => {}, seen = () => {} } = {}) {
    this.root = root;
    this.words = words.map((word) => this.encoded(`${word}\0`));
    this.hear = hear;
    this.seen = seen;
    this.printed = [];
    this.said = "";
    this.saying = new TextDecoder();
    this.open = [{ stream: 0 }, { stream: 1 }, { stream: 2 }, { node: root, at: 0 }];
  }

  encoded(text) {
    return new TextEncoder().encode(text);
  }

  // Runs a module to its end; gives its exit code and what it printed.
  run(module) {
    const calls = this.calls();
    const known = (name) => calls[name] ?? (() => NO_SUCH_CALL);
    const wanted = WebAssembly.Module.imports(module);
    const imports = Object.fromEntries(wanted.map(({ name }) => [name, known(name)]));
    const instance = new WebAssembly.Instance(module, { wasi_snapshot_preview1: imports });
    this.memory = instance.exports.memory;
    let code = 0;
    try {
      instance.exports._start();
    } catch (error) {
      if (!(error instanceof Exit)) {
        error.said = this.said;
        throw error;
      }
      code = error.code;
    }
    const decoder = new TextDecoder();
    let printed = "";
    for (const bytes of this.printed) printed += decoder.decode(bytes, { stream: true });
    return { code, printed: printed + decoder.decode(), said: this.said };
  }

  view() {
    return new DataView(this.memory.buffer);
  }

  bytesAt(at, length) {
    return new Uint8Array(this.memory.buffer, at, length);
  }

  textAt(at, length) {
    return new TextDecoder().decode(this.bytesAt(at, length));
  }

  // The parts of a scattered read or write.
  *parts(list, count) {
    const view = this.view();
    for (let k = 0; k < count; k++) {
      yield [view.getUint32(list + 8 * k, true), view.getUint32(list + 8 * k + 4, true)];
    }
  }

  // The folder and the last step of a path within an open folder.
  place(fd, at, length) {
    const base = this.open[fd]?.node;
    if (base === undefined) return { error: BAD_DESCRIPTOR };
    if (base.kind !== FOLDER) return { error: NOT_A_FOLDER };
    const walked = steps(this.textAt(at, length));
    if (walked === null) return { error: NOT_PERMITTED };
    if (walked.length === 0) return { node: base };
    const name = walked.pop();
    let folder = base;
    for (const step of walked) {
      folder = folder.entries.get(step);
      if (folder === undefined) return { error: NOT_THERE };
      if (folder.kind !== FOLDER) return { error: NOT_A_FOLDER };
    }
    return { folder, name, node: folder.entries.get(name) };
  }

  writeStat(at, node) {
    const view = this.view();
    this.bytesAt(at, 64).fill(0);
    view.setBigUint64(at + 8, BigInt(node?.id ?? 0), true);
    view.setUint8(at + 16, node?.kind ?? CHARACTERS);
    view.setBigUint64(at + 24, 1n, true);
    view.setBigUint64(at + 32, BigInt(node?.size ?? 0), true);
    return OK;
  }

  read(entry, list, count, from) {
    let at = from;
    for (const [start, length] of this.parts(list, count)) {
      let left = length;
      while (left > 0) {
        const bytes = entry.node.read(at, left);
        if (bytes.length === 0) break;
        this.bytesAt(start + length - left, bytes.length).set(bytes);
        at += bytes.length;
        left -= bytes.length;
      }
      if (left > 0) break;
    }
    if (entry.node instanceof Disk) this.seen(at - from);
    return at - from;
  }

  write(entry, list, count, from) {
    let at = from;
    for (const [start, length] of this.parts(list, count)) {
      entry.node.write(at, this.bytesAt(start, length));
      at += length;
    }
    return at - from;
  }

  print(stream, list, count) {
    let written = 0;
    for (const [start, length] of this.parts(list, count)) {
      const bytes = this.bytesAt(start, length).slice();
      written += length;
      if (stream === 1) {
        this.printed.push(bytes);
        continue;
      }
      this.said += this.saying.decode(bytes, { stream: true });
      let end;
      while ((end = this.said.indexOf("\n", this.heard ?? 0)) >= 0) {
        this.hear(this.said.slice(this.heard ?? 0, end));
        this.heard = end + 1;
      }
    }
    return written;
  }

  calls() {
    const file = (fd) => {
      const entry = this.open[fd];
      return entry?.node?.kind === FILE ? entry : undefined;
    };
    const add = (entry) => {
      let fd = this.open.indexOf(undefined);
      if (fd < 0) fd = this.open.length;
      this.open[fd] = entry;
      return fd;
    };
    return {
      args_sizes_get: (count, size) => {
        this.view().setUint32(count, this.words.length, true);
        const bytes = this.words.reduce((sum, word) => sum + word.length, 0);
        this.view().setUint32(size, bytes, true);
        return OK;
      },
      args_get: (list, buffer) => {
        let at = buffer;
        this.words.forEach((word, k) => {
          this.view().setUint32(list + 4 * k, at, true);
          this.bytesAt(at, word.length).set(word);
          at += word.length;
        });
        return OK;
      },
      environ_sizes_get: (count, size) => {
        this.view().setUint32(count, 0, true);
        this.view().setUint32(size, 0, true);
        return OK;
      },
      environ_get: () => OK,
      clock_res_get: (_clock, at) => {
        this.view().setBigUint64(at, 1_000_000n, true);
        return OK;
      },
      clock_time_get: (clock, _precision, at) => {
        const ms = clock === 0 ? Date.now() : performance.now();
        this.view().setBigUint64(at, BigInt(Math.round(ms * 1e6)), true);
        return OK;
      },
      random_get: (at, length) => {
        // The browser gives 65536 bytes at once.
        for (let k = 0; k < length; k += 65536) {
          crypto.getRandomValues(this.bytesAt(at + k, Math.min(65536, length - k)));
        }
        return OK;
      },
      sched_yield: () => OK,
      proc_exit: (code) => {
        throw new Exit(code);
      },
      fd_advise: () => OK,
      fd_allocate: () => OK,
      fd_datasync: () => OK,
      fd_sync: () => OK,
      fd_fdstat_set_flags: () => OK,
      fd_filestat_set_times: () => OK,
      path_filestat_set_times: () => OK,
      fd_close: (fd) => {
        if (this.open[fd] === undefined) return BAD_DESCRIPTOR;
        this.open[fd] = undefined;
        return OK;
      },
      fd_fdstat_get: (fd, at) => {
        const entry = this.open[fd];
        if (entry === undefined) return BAD_DESCRIPTOR;
        this.bytesAt(at, 24).fill(0);
        this.view().setUint8(at, entry.node?.kind ?? CHARACTERS);
        this.view().setUint16(at + 2, entry.append ? 1 : 0, true);
        // A stream that could be sought in is no terminal: the program draws no bars on it.
        this.view().setBigUint64(at + 8, 0x1fffffffn, true);
        this.view().setBigUint64(at + 16, 0x1fffffffn, true);
        return OK;
      },
      fd_prestat_get: (fd, at) => {
        if (fd !== ROOT) return BAD_DESCRIPTOR;
        this.view().setUint32(at, 0, true);
        this.view().setUint32(at + 4, 1, true);
        return OK;
      },
      fd_prestat_dir_name: (fd, at) => {
        if (fd !== ROOT) return BAD_DESCRIPTOR;
        this.bytesAt(at, 1)[0] = "/".charCodeAt(0);
        return OK;
      },
      fd_filestat_get: (fd, at) => {
        const entry = this.open[fd];
        return entry === undefined ? BAD_DESCRIPTOR : this.writeStat(at, entry.node);
      },
      fd_filestat_set_size: (fd, size) => {
        const entry = file(fd);
        if (!(entry?.node instanceof Bytes)) return entry ? NOT_PERMITTED : BAD_DESCRIPTOR;
        entry.node.resize(Number(size));
        return OK;
      },
      fd_read: (fd, list, count, read) => {
        const entry = file(fd);
        const length = entry ? this.read(entry, list, count, entry.at) : 0;
        if (!entry && this.open[fd]?.stream !== 0) return BAD_DESCRIPTOR;
        if (entry) entry.at += length;
        this.view().setUint32(read, length, true);
        return OK;
      },
      fd_pread: (fd, list, count, offset, read) => {
        const entry = file(fd);
        if (!entry) return BAD_DESCRIPTOR;
        this.view().setUint32(read, this.read(entry, list, count, Number(offset)), true);
        return OK;
      },
      fd_write: (fd, list, count, wrote) => {
        const entry = this.open[fd];
        let length;
        if (entry?.stream > 0) {
          length = this.print(entry.stream, list, count);
        } else if (entry?.node instanceof Bytes) {
          if (entry.append) entry.at = entry.node.size;
          length = this.write(entry, list, count, entry.at);
          entry.at += length;
        } else {
          return entry?.node instanceof Disk ? NOT_PERMITTED : BAD_DESCRIPTOR;
        }
        this.view().setUint32(wrote, length, true);
        return OK;
      },
      fd_pwrite: (fd, list, count, offset, wrote) => {
        const entry = file(fd);
        if (!(entry?.node instanceof Bytes)) return entry ? NOT_PERMITTED : BAD_DESCRIPTOR;
        this.view().setUint32(wrote, this.write(entry, list, count, Number(offset)), true);
        return OK;
      },
      fd_seek: (fd, offset, whence, at) => {
        const entry = file(fd);
        if (!entry) return BAD_DESCRIPTOR;
        const from = [0, entry.at, entry.node.size][whence];
        const to = from + Number(offset);
        if (!(to >= 0)) return INVALID;
        entry.at = to;
        this.view().setBigUint64(at, BigInt(to), true);
        return OK;
      },
      fd_tell: (fd, at) => {
        const entry = file(fd);
        if (!entry) return BAD_DESCRIPTOR;
        this.view().setBigUint64(at, BigInt(entry.at), true);
        return OK;
      },
      fd_renumber: (from, to) => {
        if (this.open[from] === undefined) return BAD_DESCRIPTOR;
        this.open[to] = this.open[from];
        this.open[from] = undefined;
        return OK;
      },
      fd_readdir: (fd, at, length, cookie, used) => {
        const node = this.open[fd]?.node;
        if (node?.kind !== FOLDER) return node ? NOT_A_FOLDER : BAD_DESCRIPTOR;
        const all = [[".", node], ["..", node], ...node.entries];
        let filled = 0;
        for (let k = Number(cookie); k < all.length && filled < length; k++) {
          const [name, entry] = all[k];
          const text = this.encoded(name);
          const bytes = new Uint8Array(24 + text.length);
          const view = new DataView(bytes.buffer);
          view.setBigUint64(0, BigInt(k + 1), true);
          view.setBigUint64(8, BigInt(entry.id), true);
          view.setUint32(16, text.length, true);
          view.setUint8(20, entry.kind);
          bytes.set(text, 24);
          const part = bytes.subarray(0, length - filled);
          this.bytesAt(at + filled, part.length).set(part);
          filled += part.length;
        }
        this.view().setUint32(used, filled, true);
        return OK;
      },
      path_open: (fd, _follow, at, length, flags, _rights, _inherit, mode, opened) => {
        const [create, asFolder, exclusive, truncate] = [1, 2, 4, 8].map((bit) => flags & bit);
        const place = this.place(fd, at, length);
        if (place.error) return place.error;
        let { node } = place;
        if (node !== undefined && create && exclusive) return EXISTS;
        if (node === undefined) {
          if (!create) return NOT_THERE;
          node = new Bytes();
          place.folder.entries.set(place.name, node);
        }
        if (asFolder && node.kind !== FOLDER) return NOT_A_FOLDER;
        if (truncate) {
          if (!(node instanceof Bytes)) return node.kind === FOLDER ? IS_FOLDER : NOT_PERMITTED;
          node.resize(0);
        }
        if (node instanceof Disk) this.reading = node.file.name;
        const entry = { node, at: 0, append: (mode & 1) === 1 };
        this.view().setUint32(opened, add(entry), true);
        return OK;
      },
      path_filestat_get: (fd, _follow, at, length, stat) => {
        const { error, node } = this.place(fd, at, length);
        if (error) return error;
        return node === undefined ? NOT_THERE : this.writeStat(stat, node);
      },
      path_create_directory: (fd, at, length) => {
        const { error, folder, name, node } = this.place(fd, at, length);
        if (error) return error;
        if (node !== undefined) return EXISTS;
        folder.entries.set(name, new Folder());
        return OK;
      },
      path_remove_directory: (fd, at, length) => {
        const { error, folder, name, node } = this.place(fd, at, length);
        if (error) return error;
        if (node === undefined) return NOT_THERE;
        if (node.kind !== FOLDER) return NOT_A_FOLDER;
        if (node.entries.size > 0) return NOT_EMPTY;
        folder?.entries.delete(name);
        return folder ? OK : NOT_PERMITTED;
      },
      path_unlink_file: (fd, at, length) => {
        const { error, folder, name, node } = this.place(fd, at, length);
        if (error) return error;
        if (node === undefined) return NOT_THERE;
        if (node.kind === FOLDER) return IS_FOLDER;
        folder.entries.delete(name);
        return OK;
      },
      path_rename: (fd, at, length, fdTo, atTo, lengthTo) => {
        const from = this.place(fd, at, length);
        const to = this.place(fdTo, atTo, lengthTo);
        if (from.error || to.error) return from.error || to.error;
        if (from.node === undefined) return NOT_THERE;
        if (!from.folder || !to.folder) return NOT_PERMITTED;
        if (to.node?.kind === FOLDER && from.node.kind !== FOLDER) return IS_FOLDER;
        from.folder.entries.delete(from.name);
        to.folder.entries.set(to.name, from.node);
        return OK;
      },
      path_readlink: () => INVALID,
    };
  }
}
