// Unpacks LZMA, which leaves a third less to send than gzip, the best that every browser has of its own.
// After the LZMA specification, which is in the public domain.
"use strict";

// The bytes of a file as `xz --format=lzma` writes it, if its header states their number.
function unpacked(packed) {
  const header = new DataView(packed.buffer, packed.byteOffset);
  const lc = packed[0] % 9;
  const lp = Math.floor(packed[0] / 9) % 5;
  const pb = Math.floor(packed[0] / 45);
  const size = Number(header.getBigUint64(5, true));
  const out = new Uint8Array(size);

  // The range coder: its range and its code, in an array because they are of 32 bits without a sign.
  const coder = Uint32Array.of(0xffffffff, header.getUint32(14));
  let next = 18;
  const refill = () => {
    if (coder[0] >= 1 << 24) return;
    coder[0] <<= 8;
    coder[1] = (coder[1] << 8) | packed[next++];
  };
  const even = (count) => new Uint16Array(count).fill(1024);
  const bit = (odds, k) => {
    const bound = (coder[0] >>> 11) * odds[k];
    let set = 0;
    if (coder[1] < bound) {
      coder[0] = bound;
      odds[k] += (2048 - odds[k]) >>> 5;
    } else {
      set = 1;
      coder[0] -= bound;
      coder[1] -= bound;
      odds[k] -= odds[k] >>> 5;
    }
    refill();
    return set;
  };
  const tree = (odds, from, count) => {
    let at = 1;
    for (let k = 0; k < count; k++) at = (at << 1) | bit(odds, from + at);
    return at - (1 << count);
  };
  const reversed = (odds, from, count) => {
    let at = 1;
    let value = 0;
    for (let k = 0; k < count; k++) {
      const set = bit(odds, from + at);
      at = (at << 1) | set;
      value |= set << k;
    }
    return value;
  };
  const direct = (count) => {
    let value = 0;
    for (let k = 0; k < count; k++) {
      coder[0] >>>= 1;
      const set = coder[1] >= coder[0] ? 1 : 0;
      if (set) coder[1] -= coder[0];
      value = (value << 1) | set;
      refill();
    }
    return value;
  };
  const lengths = () => ({ choice: even(2), short: even(16 << 3), middle: even(16 << 3), long: even(256) });
  const lengthBy = ({ choice, short, middle, long }, place) => {
    if (bit(choice, 0) === 0) return 2 + tree(short, place << 3, 3);
    if (bit(choice, 1) === 0) return 10 + tree(middle, place << 3, 3);
    return 18 + tree(long, 0, 8);
  };

  const literals = even(0x300 << (lc + lp));
  const [isMatch, isShort] = [even(12 << 4), even(12 << 4)];
  const [isRepeat, isOlder, isOlder1, isOlder2] = [even(12), even(12), even(12), even(12)];
  const [slots, near, align] = [even(4 << 6), even(128), even(16)];
  const [matchLengths, repeatLengths] = [lengths(), lengths()];
  let [back, back1, back2, back3] = [0, 0, 0, 0];
  let state = 0;
  let at = 0;
  while (at < size) {
    const place = at & ((1 << pb) - 1);
    if (bit(isMatch, (state << 4) + place) === 0) {
      const before = at > 0 ? out[at - 1] : 0;
      const from = 0x300 * (((at & ((1 << lp) - 1)) << lc) + (before >>> (8 - lc)));
      let symbol = 1;
      if (state >= 7) {
        let like = out[at - back - 1];
        while (symbol < 256) {
          const likely = (like >>> 7) & 1;
          like <<= 1;
          const set = bit(literals, from + ((1 + likely) << 8) + symbol);
          symbol = (symbol << 1) | set;
          if (set !== likely) break;
        }
      }
      while (symbol < 256) symbol = (symbol << 1) | bit(literals, from + symbol);
      out[at++] = symbol;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
      continue;
    }
    let length;
    if (bit(isRepeat, state)) {
      if (bit(isOlder, state) === 0) {
        if (bit(isShort, (state << 4) + place) === 0) {
          state = state < 7 ? 9 : 11;
          out[at] = out[at - back - 1];
          at++;
          continue;
        }
      } else if (bit(isOlder1, state) === 0) {
        [back, back1] = [back1, back];
      } else if (bit(isOlder2, state) === 0) {
        [back, back1, back2] = [back2, back, back1];
      } else {
        [back, back1, back2, back3] = [back3, back, back1, back2];
      }
      length = lengthBy(repeatLengths, place);
      state = state < 7 ? 8 : 11;
    } else {
      [back1, back2, back3] = [back, back1, back2];
      length = lengthBy(matchLengths, place);
      state = state < 7 ? 7 : 10;
      const slot = tree(slots, Math.min(length - 2, 3) << 6, 6);
      const bits = (slot >>> 1) - 1;
      back = slot;
      if (slot >= 4) {
        back = (2 | (slot & 1)) << bits;
        if (slot < 14) back += reversed(near, back - slot, bits);
        else back += (direct(bits - 4) << 4) + reversed(align, 0, 4);
      }
    }
    if (back >= at) throw new Error("the program within the page is damaged; load the page again");
    for (const end = Math.min(at + length, size); at < end; at++) out[at] = out[at - back - 1];
  }
  return out;
}
