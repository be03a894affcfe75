/**
 * This client's view: its camera, size and settings, and the messages that keep the server's copy the same.
 *
 * Every change is numbered by camera_seq. Every frame echoes the number of the change it shows, so overlays are drawn with
 * exactly that camera, and the time from a movement to its picture is measured.
 */
import { computed, signal } from '@preact/signals';
import { recall, remember } from '../lib/store';
import { Pacer } from '../lib/pacer';
import type { FrameHeader } from '../protocol/frame';
import type { Json, JsonObject, RpcError } from '../protocol/rpc';
import { numberOr, vec3Or, type CameraPose, type SceneRecord } from '../protocol/types';
import { orbitFromPose, poseFromOrbit, type Orbit } from '../view/camera';
import { CameraNumbers } from './camera_seq';

const NATIVE = 8_388_608;
/** How many pixels to ask for while something moves, and at rest. The picture is stretched to the window. */
export const RESOLUTIONS = {
    fast: { label: 'Few pixels, fast', pixels: 160_000, atRest: 160_000 },
    balanced: { label: 'All at rest, fast in motion', pixels: 400_000, atRest: NATIVE },
    fine: { label: 'All at rest, fine in motion', pixels: 1_000_000, atRest: NATIVE },
    native: { label: 'All, always', pixels: NATIVE, atRest: NATIVE },
} as const;
export type Resolution = keyof typeof RESOLUTIONS;

/** How good pictures are while something moves. At rest all are exact. */
export const STREAMS = {
    low: { label: 'Low bandwidth', codec: 'jpeg', quality: 55 },
    jpeg: { label: 'Automatic', codec: 'jpeg', quality: 85 },
    high: { label: 'High quality', codec: 'jpeg', quality: 95 },
    png: { label: 'Exact, always', codec: 'png', quality: 100 },
} as const;
export type Stream = keyof typeof STREAMS;
/** The error at which refinement of a picture at rest ends, from fast to exact. */
export const STOPS = {
    /** An error that any whole picture is below. */
    fast: 10,
    '10 %': 0.1,
    '5 %': 0.05,
    '2 %': 0.02,
    '1 %': 0.01,
    '0.5 %': 0.005,
    /** It goes on to the scene's number of samples. */
    exact: null,
} as const;
export type Stop = keyof typeof STOPS;
export const STOP_NAMES = Object.keys(STOPS) as Stop[];

/** Maps that the server lays over the picture. */
export const OVERLAYS = {
    none: 'Off',
    luminance: 'Luminance',
    illuminance: 'Illuminance',
    error: 'Error',
    shapes: 'Shapes',
    guidance_soft_shadow: 'Refined: soft shadows',
    guidance_indirect_diffuse: 'Refined: indirect light',
    guidance_media: 'Refined: media',
} as const;
export type OverlayName = keyof typeof OVERLAYS;

/** Maps of light, whose colours stand for values as somebody wants them to. */
export const isOfLight = (overlay: OverlayName): boolean => overlay === 'luminance' || overlay === 'illuminance';

/** How maps of light are drawn; as the protocol has it. */
export interface FalseColour {
    scale: 'log' | 'linear';
    /** Ends of the scale; null: as the picture has it. */
    min: number | null;
    max: number | null;
    smooth: boolean;
    lines: 'off' | 'on' | 'only';
    palette: 'even' | 'spectrum';
}
export const PLAIN_FALSE_COLOUR: FalseColour = { scale: 'log', min: null, max: null, smooth: false, lines: 'off', palette: 'even' };

/** auto: when the scene calls for it. */
export const FORCES = ['auto', 'off', 'on'] as const;
export type Force = (typeof FORCES)[number];

export interface ViewSettings {
    /** null: the scene's. */
    method: string | null;
    exposure: { auto: boolean; ev: number } | null;
    toneMap: string | null;
    /** Light of this temperature is shown as white; null: as it is. */
    whiteBalance: number | null;
    /** By name; those not named are automatic. */
    effects: Readonly<Record<string, Force>>;
    overlay: OverlayName;
    falseColour: FalseColour;
    stop: Stop;
    /** Lamps and groups that alone shine in this view; empty: all that are on. */
    solo: readonly string[];
    /** Revision of the scene that is shown; null: now. */
    moment: number | null;
    resolution: Resolution;
    stream: Stream;
}

/** What the server names where a moment is refused. */
const MOMENTS = ['moment', 'scene_rev'];

/** Where null is what the scene has, whatever that becomes. */
const OF_SCENE = ['method', 'exposure', 'toneMap'] as const;

const KEY = 'lumend.view';

/** How fine and over how thin a line is a matter of this machine, and remembered; the rest belongs to the scene. */
function rememberedSettings(): ViewSettings {
    const [resolution, stream] = (recall('localStorage', KEY) ?? '').split(' ');
    return {
        method: null,
        exposure: null,
        toneMap: null,
        whiteBalance: null,
        effects: {},
        overlay: 'none',
        falseColour: PLAIN_FALSE_COLOUR,
        stop: 'exact',
        solo: [],
        moment: null,
        resolution: resolution && resolution in RESOLUTIONS ? (resolution as Resolution) : 'balanced',
        stream: stream && stream in STREAMS ? (stream as Stream) : 'jpeg',
    };
}

/** LUM_LIMIT_SOLO: names of lamps and groups that a view is shown by alone. */
export const MOST_SOLO = 16;
/** LUM_LIMIT_VIEW_SIDE */
const MAX_SIDE = 4096;
/** Poses of cameras that no frame has shown yet; a server that is this far behind has skipped the older ones. */
const MAX_POSES = 512;

export const DEFAULT_POSE: CameraPose = { position: [3, 2, 5], target: [0, 1, 0], up: [0, 1, 0], vfov_deg: 45 };

/** Whole pixels with the window's aspect, at most `pixels` of them and not more than the screen has. */
export function viewSize(cssW: number, cssH: number, ratio: number, pixels: number): [number, number] {
    const w = Math.max(1, cssW * ratio);
    const h = Math.max(1, cssH * ratio);
    const s = Math.min(1, Math.sqrt(pixels / (w * h)), MAX_SIDE / w, MAX_SIDE / h);
    return [Math.max(1, Math.floor(w * s)), Math.max(1, Math.floor(h * s))];
}

const same = (a: readonly number[], b: readonly number[]): boolean => a[0] === b[0] && a[1] === b[1];

/** Changes sent before the first of them is answered: what is changed meanwhile waits, and only the newest of it is sent. */
const MAX_UNANSWERED = 2;

interface Sent {
    pose: CameraPose;
    /** null: the view was opened with it, and nobody's hand moved. */
    at: number | null;
}

/** What the server has not been told. */
interface Dirty {
    camera: boolean;
    size: boolean;
    settings: boolean;
    tiles: boolean;
    /** An update cannot say it: what is left out of it stays. */
    anew: boolean;
}
const clean = (): Dirty => ({ camera: false, size: false, settings: false, tiles: false, anew: false });

export class ViewLink {
    readonly orbit = signal<Orbit>(orbitFromPose(DEFAULT_POSE));
    readonly settings = signal<ViewSettings>(rememberedSettings());
    /** The camera of the frame on screen. */
    readonly shownPose = signal<CameraPose>(DEFAULT_POSE);
    readonly cssSize = signal<[number, number]>([1, 1]);
    readonly aspect = computed(() => this.cssSize.value[0] / this.cssSize.value[1]);
    /** The size the server was asked for. */
    readonly size = signal<[number, number]>([1, 1]);
    /** And of the picture once nothing moves. */
    restSize: [number, number] = [1, 1];
    /** Something of this view was changed that no frame shows yet. */
    readonly pending = signal(false);
    viewId: number | null = null;

    private opening = false;
    /** What this browser reads beside JPEG and PNG: the server chooses for a thin line. */
    private codecs: readonly string[] = ['webp'];
    private unanswered = 0;
    /** Effects that the server was told of, for this view: those that are none of the settings any more are automatic again. */
    private readonly told = new Set<string>();
    private readonly numbers = new CameraNumbers('view');
    private readonly sent = new Map<number, Sent>();
    private dirty = clean();
    private readonly pacer = new Pacer(() => void this.flush());

    constructor(
        private readonly call: (method: string, params: JsonObject) => Promise<JsonObject>,
        private readonly onError: (error: Error) => void,
        /** False: the method makes a picture in one pass, and the server refuses to hold it to an error. */
        private readonly addsSamples: () => boolean,
    ) {}

    moveTo(orbit: Orbit): void {
        this.orbit.value = orbit;
        this.mark('camera');
    }

    /** As a link says; what it does not name is as usual, but for what is of this machine. */
    show(pose: CameraPose | null, settings: Partial<ViewSettings>): void {
        const before = this.settings.value;
        const { stop, resolution, stream } = before;
        if (pose) this.moveTo(orbitFromPose(pose));
        this.change({ ...rememberedSettings(), stop, resolution, stream, ...settings });
        if (OF_SCENE.some((name) => before[name] !== null && this.settings.value[name] === null)) this.mark('anew');
    }

    resize(cssW: number, cssH: number, ratio: number): void {
        this.cssSize.value = [cssW, cssH];
        this.fit(ratio);
    }

    change(settings: Partial<ViewSettings>): void {
        const next = { ...this.settings.value, ...settings };
        this.settings.value = next;
        remember('localStorage', KEY, `${next.resolution} ${next.stream}`);
        this.fit(window.devicePixelRatio);
        this.mark('settings');
    }

    private fit(ratio: number): void {
        const [w, h] = this.cssSize.value;
        const { pixels, atRest } = RESOLUTIONS[this.settings.value.resolution];
        const size = viewSize(w, h, ratio, pixels);
        const rest = viewSize(w, h, ratio, atRest);
        if (same(size, this.size.value) && same(rest, this.restSize)) return;
        this.size.value = size;
        this.restSize = rest;
        this.mark('size');
    }

    async open(): Promise<void> {
        this.viewId = null;
        this.unanswered = 0;
        this.opening = true;
        this.numbers.begin();
        this.told.clear();
        const { moment } = this.settings.peek();
        try {
            this.dirty = clean();
            const reply = await this.call('view.open', {
                ...this.numbered(null),
                camera: this.pose(),
                size: this.size.value,
                rest_size: this.restSize,
                ...this.settingParams(),
            });
            this.viewId = Number(reply.view_id);
        } catch (error) {
            if (!this.leaves(moment, error as RpcError)) throw error;
            return await this.open();
        } finally {
            this.opening = false;
        }
        if (this.isDirty()) this.pacer.request();
    }

    closed(): void {
        this.viewId = null;
        this.sent.clear();
        this.settle();
    }

    /** Frames may overtake the reply to view.open that names their view. */
    owns(viewId: number, cameraSeq: number): boolean {
        return (this.opening || viewId === this.viewId) && this.numbers.has(cameraSeq);
    }

    /** A frame is on screen. Returns how long ago its change was sent, null when it shows one that was shown before. */
    drawn(h: FrameHeader): number | null {
        const sent = this.sent.get(h.cameraSeq);
        if (!sent) return null;
        this.shownPose.value = sent.pose;
        for (const seq of this.sent.keys()) if (seq <= h.cameraSeq) this.sent.delete(seq);
        this.settle();
        return sent.at === null ? null : performance.now() - sent.at;
    }

    /** Asks for all tiles anew: one of those that came could not be shown. */
    resend(): void {
        this.mark('tiles');
    }

    /** Also, or not: a part of it could not be shown. */
    reads(codec: string, does: boolean): void {
        if (this.codecs.includes(codec) === does) return;
        this.codecs = does ? [...this.codecs, codec] : this.codecs.filter((c) => c !== codec);
        this.mark('settings');
    }

    private settle(): void {
        this.pending.value = this.sent.size > 0 || this.isDirty();
    }

    /** Something was changed that the server has not been told. */
    isDirty(): boolean {
        return Object.values(this.dirty).some((d) => d);
    }

    private mark(what: keyof Dirty): void {
        this.dirty[what] = true;
        this.pending.value = true;
        if (this.viewId !== null) this.pacer.request();
    }

    private async flush(): Promise<void> {
        const { viewId } = this;
        if (viewId === null || this.unanswered >= MAX_UNANSWERED || !this.isDirty()) return;
        const { camera, size, settings, tiles, anew } = this.dirty;
        const { moment } = this.settings.peek();
        if (anew) return this.again(viewId);
        this.dirty = clean();
        const params: JsonObject = { view_id: viewId, ...this.numbered(performance.now()) };
        const seq = this.numbers.last;
        if (camera) params.camera = this.pose();
        if (size) Object.assign(params, { size: this.size.value, rest_size: this.restSize });
        if (settings) Object.assign(params, this.settingParams());
        if (tiles) params.resend = true;
        this.unanswered++;
        try {
            await this.call('view.update', params);
        } catch (error) {
            this.sent.delete(seq); // no frame will show it
            this.settle();
            if (settings && this.leaves(moment, error as RpcError)) Object.assign(this.dirty, camera && { camera }, size && { size }, tiles && { tiles });
            else this.onError(error as Error);
        }
        if (viewId !== this.viewId) return; // of a connection that is gone, whose count is
        this.unanswered--;
        if (this.isDirty()) this.pacer.request();
    }

    /** True: the view was refused for a moment that is not kept, as by a server that began anew, and now is shown in its place. */
    private leaves(moment: number | null, error: RpcError): boolean {
        if (moment === null || error.app !== 'not_found' || !MOMENTS.includes(error.path)) return false;
        if (this.settings.peek().moment === moment) this.change({ moment: null });
        this.onError(new Error(`${error.message}. Now is shown`));
        return true;
    }

    private async again(viewId: number): Promise<void> {
        this.call('view.close', { view_id: viewId }).catch(this.onError);
        await this.open().catch(this.onError);
    }

    /** What shows the same as this view, but for its camera, method and quality: for a view beside it. ev: as this one is exposed; scale: of its map. */
    likeParams(ev: number, scale: { min: number; max: number } | null): JsonObject {
        const s = this.settings.value;
        const { codec, quality } = STREAMS[s.stream];
        const codecs = this.codecs.filter((c) => c !== 'vp9'); // of pictures that rest
        const params: JsonObject = { size: [...this.size.value], codec, codecs, quality, white_balance_k: s.whiteBalance, solo: [...s.solo], moment: s.moment, exposure_ev: ev };
        params.overlay = isOfLight(s.overlay) ? s.overlay : 'none';
        if (isOfLight(s.overlay)) params.false_color = { ...s.falseColour, min: s.falseColour.min ?? scale?.min ?? null, max: s.falseColour.max ?? scale?.max ?? null };
        if (Object.keys(s.effects).length > 0) params.effects = { ...s.effects };
        if (s.toneMap !== null) params.tone_map = s.toneMap;
        return params;
    }

    private pose(): Json {
        return poseFromOrbit(this.orbit.value) as unknown as Json;
    }

    /** The number of the change that is being sent, and a note of the camera that goes with it. */
    private numbered(at: number | null): JsonObject {
        const seq = this.numbers.next();
        this.sent.set(seq, { pose: poseFromOrbit(this.orbit.value), at });
        if (this.sent.size > MAX_POSES) this.sent.delete(this.sent.keys().next().value!);
        this.pending.value = true;
        return { camera_seq: seq };
    }

    private settingParams(): JsonObject {
        const s = this.settings.value;
        const { codec, quality } = STREAMS[s.stream];
        const error = STOPS[s.stop];
        const budget: JsonObject = error !== null && this.addsSamples() ? { error } : {};
        const params: JsonObject = { codec, codecs: [...this.codecs], quality, white_balance_k: s.whiteBalance, overlay: s.overlay, budget, solo: [...s.solo], moment: s.moment };
        if (isOfLight(s.overlay)) params.false_color = { ...s.falseColour };
        for (const name of Object.keys(s.effects)) this.told.add(name);
        if (this.told.size > 0) params.effects = Object.fromEntries([...this.told].map((name) => [name, s.effects[name] ?? 'auto']));
        if (s.method !== null) params.method = s.method;
        if (s.toneMap !== null) params.tone_map = s.toneMap;
        if (s.exposure !== null) params.exposure_ev = s.exposure.auto ? null : s.exposure.ev;
        return params;
    }
}

/** What a camera of the scene sees. */
export function poseOf(camera: SceneRecord | undefined): CameraPose {
    if (!camera) return DEFAULT_POSE;
    return {
        position: vec3Or(camera.position, DEFAULT_POSE.position),
        target: vec3Or(camera.target, DEFAULT_POSE.target),
        up: vec3Or(camera.up, DEFAULT_POSE.up),
        vfov_deg: numberOr(camera.vfov_deg, DEFAULT_POSE.vfov_deg),
    };
}
