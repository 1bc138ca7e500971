// A zip archive of files, stored as they are.
"use strict";

const CRC = Uint32Array.from({ length: 256 }, (_, n) => {
  for (let k = 0; k < 8; k++) n = n & 1 ? (n >>> 1) ^ 0xedb88320 : n >>> 1;
  return n;
});

function crc32(bytes) {
  let crc = ~0;
  for (const byte of bytes) crc = (crc >>> 8) ^ CRC[(crc ^ byte) & 255];
  return ~crc >>> 0;
}

function zipped(files) {
  const parts = [];
  const index = [];
  let at = 0;
  // Names are UTF-8; every file is of the first day that the format knows.
  const shared = (name, bytes) => [[4, 0x0800_0014], [2, 0], [4, 0x0021_0000], [4, crc32(bytes)],
    [4, bytes.length], [4, bytes.length], [2, name.length], [2, 0]];
  const record = (fields) => {
    const view = new DataView(new ArrayBuffer(fields.reduce((sum, [size]) => sum + size, 0)));
    let k = 0;
    for (const [size, value] of fields) {
      if (size === 2) view.setUint16(k, value, true);
      else view.setUint32(k, value, true);
      k += size;
    }
    return new Uint8Array(view.buffer);
  };
  for (const { path, bytes } of files) {
    const name = new TextEncoder().encode(path);
    const local = record([[4, 0x04034b50], ...shared(name, bytes)]);
    parts.push(local, name, bytes);
    index.push(record([[4, 0x02014b50], [2, 20], ...shared(name, bytes), [2, 0], [2, 0], [2, 0], [4, 0], [4, at]]), name);
    at += local.length + name.length + bytes.length;
  }
  const length = index.reduce((sum, part) => sum + part.length, 0);
  const end = record([[4, 0x06054b50], [4, 0], [2, files.length], [2, files.length], [4, length], [4, at], [2, 0]]);
  return new Blob([...parts, ...index, end], { type: "application/zip" });
}
