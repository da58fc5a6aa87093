// A film of pictures: VP8 by the browser's encoder, in a WebM file written here, so that each picture has its exact
// time however long it took to draw.

const bytesOf = (...parts: (number[] | Uint8Array)[]): Uint8Array => {
  const out = new Uint8Array(parts.reduce((n, p) => n + p.length, 0));
  let at = 0;
  for (const p of parts) {
    out.set(p, at);
    at += p.length;
  }
  return out;
};

/** A whole number in as many bytes as it takes, the largest first. */
function integer(x: number): number[] {
  const out = [];
  do {
    out.unshift(x % 256);
    x = Math.floor(x / 256);
  } while (x > 0);
  return out;
}

/** EBML: identifier, size in eight bytes, content. */
function element(id: number, content: number[] | Uint8Array): Uint8Array {
  const size = integer(content.length);
  return bytesOf(integer(id), [0x01, ...new Array(7 - size.length).fill(0), ...size], content);
}

const text = (s: string) => new TextEncoder().encode(s);
function float(x: number): Uint8Array {
  const out = new Uint8Array(8);
  new DataView(out.buffer).setFloat64(0, x);
  return out;
}

export interface Coded {
  time: number; // [ms]
  key: boolean;
  bytes: Uint8Array;
}

/** A WebM file of one video track. Source: RFC 9559 (Matroska), RFC 8794 (EBML). */
export function webm(width: number, height: number, frames: Coded[], duration: number): Blob {
  const head = element(
    0x1a45dfa3,
    bytesOf(
      element(0x4286, [1]), // EBMLVersion
      element(0x42f7, [1]), // EBMLReadVersion
      element(0x42f2, [4]), // EBMLMaxIDLength
      element(0x42f3, [8]), // EBMLMaxSizeLength
      element(0x4282, text("webm")), // DocType
      element(0x4287, [4]), // DocTypeVersion
      element(0x4285, [2]), // DocTypeReadVersion
    ),
  );
  const info = element(
    0x1549a966,
    bytesOf(
      element(0x2ad7b1, integer(1000000)), // TimestampScale: milliseconds
      element(0x4489, float(duration)), // Duration
      element(0x4d80, text("amontons")), // MuxingApp
      element(0x5741, text("amontons studio")), // WritingApp
    ),
  );
  const tracks = element(
    0x1654ae6b,
    element(
      0xae, // TrackEntry
      bytesOf(
        element(0xd7, [1]), // TrackNumber
        element(0x73c5, [1]), // TrackUID
        element(0x83, [1]), // TrackType: video
        element(0x86, text("V_VP8")), // CodecID
        element(0xe0, bytesOf(element(0xb0, integer(width)), element(0xba, integer(height)))), // Video
      ),
    ),
  );
  const clusters: Uint8Array[] = [];
  for (let i = 0; i < frames.length; ) {
    const begin = frames[i].time;
    const blocks = [element(0xe7, integer(begin))]; // Timestamp
    for (; i < frames.length && (blocks.length === 1 || (!frames[i].key && frames[i].time - begin < 30000)); ++i) {
      const after = frames[i].time - begin; // signed, 16 bits
      blocks.push(
        element(0xa3, bytesOf([0x81, (after >> 8) & 255, after & 255, frames[i].key ? 0x80 : 0], frames[i].bytes)),
      );
    }
    clusters.push(element(0x1f43b675, bytesOf(...blocks)));
  }
  const segment = element(0x18538067, bytesOf(info, tracks, ...clusters));
  return new Blob([head as BlobPart, segment as BlobPart], { type: "video/webm" });
}

/**
 * @param count    pictures
 * @param picture  draws one
 * @throws Error  the browser has no encoder
 */
export async function film(
  count: number,
  perSecond: number,
  picture: (index: number) => Promise<HTMLCanvasElement>,
): Promise<Blob> {
  if (!("VideoEncoder" in window)) throw new Error("this browser has no encoder of films (WebCodecs)");
  const frames: Coded[] = [];
  let failure: Error | null = null;
  const encoder = new VideoEncoder({
    output: (chunk) => {
      const bytes = new Uint8Array(chunk.byteLength);
      chunk.copyTo(bytes);
      frames.push({ time: Math.round(chunk.timestamp / 1000), key: chunk.type === "key", bytes });
    },
    error: (e) => (failure = e),
  });
  const canvas = document.createElement("canvas");
  const g = canvas.getContext("2d")!;
  for (let i = 0; i < count && !failure; ++i) {
    const from = await picture(i);
    if (i === 0) {
      canvas.width = from.width - (from.width % 2); // colours have half the points
      canvas.height = from.height - (from.height % 2);
      encoder.configure({
        codec: "vp8",
        width: canvas.width,
        height: canvas.height,
        bitrate: 8 * canvas.width * canvas.height,
        framerate: perSecond,
      });
    }
    g.drawImage(from, 0, 0, canvas.width, canvas.height);
    const frame = new VideoFrame(canvas, { timestamp: Math.round((1e6 * i) / perSecond) });
    encoder.encode(frame, { keyFrame: i % (2 * perSecond) === 0 });
    frame.close();
    while (encoder.encodeQueueSize > 4) await new Promise((r) => setTimeout(r, 5));
  }
  await encoder.flush();
  encoder.close();
  if (failure) throw failure;
  return webm(canvas.width, canvas.height, frames, (1000 * count) / perSecond);
}
