/** Bytes through the streams that browsers and node have. */

/** Those bytes through a stream; more than `limit` of them are refused before they are kept. */
export async function through(bytes: Uint8Array, stream: GenericTransformStream, limit: number): Promise<Uint8Array> {
    const reader = (new Blob([bytes as BlobPart]).stream().pipeThrough(stream) as ReadableStream<Uint8Array>).getReader();
    const parts: Uint8Array[] = [];
    let length = 0;
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
        length += part.value.length;
        if (length > limit) {
            await reader.cancel();
            throw new RangeError(`a tile that unpacks to more than ${limit} bytes`);
        }
        parts.push(part.value);
    }
    return joined(parts);
}

export function joined(parts: readonly Uint8Array[]): Uint8Array {
    const all = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
    let at = 0;
    for (const part of parts) {
        all.set(part, at);
        at += part.length;
    }
    return all;
}
