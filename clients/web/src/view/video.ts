/** A view's pictures as chunks of VP9, by WebCodecs: each becomes one picture, in their order. Loaded with the first of them. */
import { Flag, type Frame } from '../protocol/frame';
import { PASSED_OVER, SILENT, VP9 } from './reads';

/** Without a picture for so long, while some are awaited, none will come: a decoder has some milliseconds for each. */
const SILENT_MS = 2000;

interface Awaited {
    give(frame: VideoFrame): void;
    fail(error: Error): void;
}

/** One that could not be decoded was told of, and this chunk is no worse than that: a key chunk is on its way. */
function passedOver(): Error {
    return Object.assign(new Error('a part of the video is missing'), { name: PASSED_OVER });
}

export class Video {
    private decoder: VideoDecoder | null = null;
    /** By the number of their frame. */
    private readonly awaited = new Map<number, Awaited>();
    /** Runs while pictures are awaited, from the last that came. */
    private watchdog: ReturnType<typeof setTimeout> | undefined;
    /** Somebody was told that a part is missing. */
    private told = false;

    /** Fails for what is broken, and for all after that up to the next key chunk. */
    decode({ header, payload }: Frame): Promise<VideoFrame> {
        const key = (header.flags & Flag.key) !== 0;
        if (key && !this.decoder) this.open();
        const { decoder } = this;
        if (!decoder) return Promise.reject(this.missing(new Error('the decoder of video was closed')));
        return new Promise((give, fail) => {
            this.awaited.set(header.frameSeq, { give, fail });
            if (this.awaited.size === 1) this.watch(decoder);
            try {
                decoder.decode(new EncodedVideoChunk({ type: key ? 'key' : 'delta', timestamp: header.frameSeq, data: payload }));
            } catch (error) {
                this.failed(decoder, error as Error);
            }
        });
    }

    /** What comes next begins with a key chunk. */
    close(): void {
        if (this.decoder) this.failed(this.decoder, new Error('the picture is another'));
    }

    private open(): void {
        const decoder = new VideoDecoder({
            output: (frame) => this.took(decoder, frame),
            error: (error) => this.failed(decoder, error),
        });
        this.decoder = decoder;
        this.told = false;
        decoder.configure(VP9);
    }

    private took(decoder: VideoDecoder, frame: VideoFrame): void {
        const awaited = this.awaited.get(frame.timestamp);
        this.awaited.delete(frame.timestamp);
        this.watch(decoder);
        if (awaited) awaited.give(frame);
        else frame.close();
    }

    /** The time is taken in two parts: where this page or its machine slept, what came meanwhile is seen between them. */
    private watch(decoder: VideoDecoder, parts = 2): void {
        clearTimeout(this.watchdog);
        if (this.awaited.size === 0) return;
        const silent = (): void => this.failed(decoder, Object.assign(new Error('the decoder of video gives nothing'), { name: SILENT }));
        this.watchdog = setTimeout(() => (parts > 1 ? this.watch(decoder, parts - 1) : silent()), SILENT_MS / 2);
    }

    /** Nothing comes of what it was given. */
    private failed(decoder: VideoDecoder, error: Error): void {
        if (decoder !== this.decoder) return;
        this.decoder = null;
        if (decoder.state !== 'closed') decoder.close();
        const all = [...this.awaited.values()];
        this.awaited.clear();
        clearTimeout(this.watchdog);
        for (const { fail } of all) fail(this.missing(error));
    }

    private missing(error: Error): Error {
        if (this.told) return passedOver();
        this.told = true;
        return error;
    }
}
