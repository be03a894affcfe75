/**
 * What each request takes and is answered, as protocol/PROTOCOL.md says; units are in the names. That page tells them in prose and
 * examples: a test holds its examples against these types, and Params and Answers to the list of methods that is made from it.
 */
import type { AnswersByExample, FrameStats, Light, Method, ParamsByExample, Records, Sensor } from './records.js';
import type { JsonObject } from './rpc.js';

type Vec3 = readonly [number, number, number];

export interface CameraPose {
    position: Vec3;
    target: Vec3;
    up?: Vec3;
    vfov_deg?: number;
    projection?: 'perspective' | 'panorama';
}

/** Of view.open and view.update. */
export interface ViewMembers {
    size?: readonly [number, number];
    rest_size?: readonly [number, number];
    camera?: CameraPose;
    camera_id?: string;
    camera_seq?: number;
    codec?: 'jpeg' | 'png' | 'rgba8' | 'half_deflate' | 'webp';
    codecs?: readonly string[] | null;
    quality?: number;
    downscale?: 0 | 1 | 2;
    method?: string;
    spp?: number;
    exposure_ev?: number | null;
    tone_map?: NonNullable<Records['render']['tone_map']>;
    white_balance_k?: number | null;
    moment?: number | null;
    effects?: Readonly<Record<string, 'off' | 'on' | 'auto'>>;
    overlay?: 'none' | 'luminance' | 'illuminance' | 'error' | 'shapes' | 'guidance_soft_shadow' | 'guidance_indirect_diffuse' | 'guidance_media';
    false_color?: {
        scale?: 'log' | 'linear';
        min?: number | null;
        max?: number | null;
        smooth?: boolean;
        lines?: 'off' | 'on' | 'only';
        palette?: 'even' | 'spectrum';
    };
    budget?: { time_ms?: number; error?: number };
    solo?: readonly string[] | null;
    stats?: boolean;
    resend?: boolean;
}

/** How an edit is told apart: sent again with repeat it is done once. */
export interface EditMembers {
    op_id?: string;
    repeat?: boolean;
}

interface Edited {
    scene_rev: number;
    repeated?: boolean;
    warnings?: readonly string[];
}

export interface SessionLimits {
    message_bytes: number;
    messages_per_s: number;
    bytes_per_s: number;
    burst_bytes: number;
    json_depth: number;
    ops_per_message: number;
    views: number;
    view_side: number;
    view_pixels: number;
    unacked_frames: number;
    tile_side: number;
    undo_steps: number;
    undo_bytes: number;
    upload_bytes: number;
    upload_files: number;
}

export interface PhotometryOfWeb {
    flux_lm: number;
    rated_lm?: number;
    watts?: number;
    lm_per_w?: number;
    name?: string;
    up: number;
    peak_cd: number;
    peak_c_deg: number;
    peak_gamma_deg: number;
    beam_deg: readonly [number, number];
    field_deg: readonly [number, number];
    symmetry: 'axial' | 'quadrant' | 'c0-c180' | 'c90-c270' | 'none';
    type: 'c' | 'b' | 'a';
    opening: 'point' | 'rectangle' | 'disc' | 'sphere';
    size: Vec3;
    /** Crosswise, endwise; absent where the opening is a point. */
    ugr?: readonly [number, number];
    planes: number;
    angles: number;
    polar_cd: Record<'gamma_deg' | 'c0' | 'c90' | 'c180' | 'c270', readonly number[]>;
}

/** One of the notification `sensors`. */
export interface Power {
    watts: number;
    floor_m2: number;
    w_per_m2: number | null;
    w_per_m2_100_lx: number | null;
    w_per_m2_100_lx_stderr: number | null;
    lamps: number;
    lamps_without_watts: number;
    without_watts: readonly { what: string; id: string; n: number }[];
}

export interface SensorValue {
    id: string;
    kind: Sensor['kind'];
    quantity?: NonNullable<Sensor['quantity']>;
    scene_rev: number;
    settled: boolean;
    nu?: number;
    nv?: number;
    left_out?: number;
    em_lx?: number | null;
    em_stderr_lx?: number | null;
    emin_lx?: number | null;
    emin_stderr_lx?: number | null;
    emax_lx?: number | null;
    emax_stderr_lx?: number | null;
    uo?: number | null;
    uo_stderr?: number | null;
    /** With quantity "modelling". */
    ez_lx?: number | null;
    ez_stderr_lx?: number | null;
    modelling?: number | null;
    modelling_stderr?: number | null;
    modelling_in_range?: boolean;
    /** With quantity "ugr". */
    directions?: number;
    worst_point?: readonly number[];
    worst_direction?: readonly number[];
    point_ugr?: readonly (number | null)[];
    /** The rest is of an observer, or of quantity "ugr", but for power and targets. */
    ugr?: number | null;
    ugr_stderr?: number | null;
    background_cd_m2?: number | null;
    background_stderr_cd_m2?: number | null;
    sources?: number;
    sources_out_of_range?: number;
    lamps_without_extent?: number;
    dgp?: number | null;
    dgp_stderr?: number | null;
    dgp_band?: 'imperceptible' | 'perceptible' | 'disturbing' | 'intolerable';
    dgp_sources?: number;
    dgp_in_range?: boolean;
    eye_lx?: number | null;
    eye_stderr_lx?: number | null;
    /** Of the largest level grid alone. */
    power?: Power;
    targets?: Partial<Record<'em' | 'uo' | 'ugr' | 'dgp', { target: number; passes: boolean; sure: boolean }>>;
    lx?: readonly (number | null)[];
}

type None = Record<string, never>;
type Pixel = { view_id: number; x: number; y: number };

/** What a request takes, of those that take or are answered more than the example of the page shows. */
interface ToldParams {
    'session.hello': { token?: string; client?: string; resume?: string; key?: string; scene_rev?: number; project?: string };
    'scene.get': { expand?: boolean };
    'view.open': ViewMembers & { size: readonly [number, number] };
    'view.update': ViewMembers & { view_id: number };
    'view.read': Pixel;
    'frame.ack': { view_id: number; frame_seq: number; held_ms?: number };
    pick: Pixel;
    photometry: { id: string };
    daylight: None;
    'stats.get': None;
    probe: { samples?: number; view_id?: number } & ({ point: Vec3; normal: Vec3 } | Pixel);
    'sensor.watch': { on?: boolean; points?: boolean };
    'sensor.read': { id: string };
    'sensor.place': { on?: string; height_m?: number; border_m?: number; directions?: number };
    'report.get': { view_id?: number };
    'scene.apply': EditMembers & { ops: readonly JsonObject[]; base_rev?: number; undo_group?: string };
    'scene.undo': EditMembers;
    'scene.redo': EditMembers;
    'scene.revert': EditMembers & { scene_rev: number };
    'timeline.get': { since_rev?: number };
    'preset.store': EditMembers & { id: string; name?: string; fade_s?: number };
    'preset.recall': EditMembers & { id: string; fade_s?: number };
    'preset.stop': EditMembers;
    'asset.list': { kind: 'photometry'; match?: string };
    'asset.photometry': { asset: string };
    'session.list': None;
    'presence.set': { camera?: CameraPose | null; point?: Vec3 | null };
    'project.list': None;
    'project.create': { name: string } & ({ scene?: string } | { from: string; version?: string });
    'project.rename': { project: string; name: string };
    'project.delete': { project: string };
    'project.restore': { project: string };
    'project.erase': { project: string };
    'version.list': { project: string };
    'version.remove': { project: string; version: string };
}

/** What it is answered. */
interface ToldAnswers {
    'session.hello': {
        session: string;
        role: 'view' | 'measure' | 'edit' | 'admin';
        key: string;
        resumed: boolean;
        missed: number | null;
        imports: boolean;
        uploads: boolean;
        /** It has many scenes; `project`: whose this session is, null: none's. */
        projects: boolean;
        project: { id: string; name: string } | null;
        saved: 'commit' | 'interval' | 'no';
        limits: SessionLimits;
        /** null: the session is of no project. */
        scene_rev: number | null;
        protocol: number;
    };
    'scene.get': { ops: readonly JsonObject[]; scene_rev: number };
    'view.open': { view_id: number };
    'view.update': JsonObject;
    'view.read': { unit: 'cd/m2' | 'lx'; value: number | null; error: number | null; camera_seq: number; scene_rev: number };
    'frame.ack': JsonObject;
    pick: { id: string | null; point?: Vec3; normal?: Vec3; distance?: number };
    photometry: PhotometryOfWeb;
    daylight: {
        sun: { id: string; elevation_deg: number; azimuth_deg: number; illuminance_lx: number; horizontal_lx: number } | null;
        sky: { id: string; luminance_cd_m2: number; horizontal_lx: number } | null;
    };
    'stats.get': JsonObject;
    probe: {
        illuminance_lx: number;
        stderr_lx: number;
        irradiance: Vec3;
        point: Vec3;
        normal: Vec3;
        samples: number;
        rays: number;
        scene_rev: number;
    };
    'sensor.watch': JsonObject;
    'sensor.read': Partial<SensorValue> & {
        id: string;
        points?: readonly { point: Vec3; lx?: number; stderr_lx?: number; ugr?: number; ugr_stderr?: number; direction?: Vec3; left_out?: string }[];
    };
    'sensor.place': Sensor;
    'report.get': { scene_rev: number; html: string };
    'scene.apply': Edited;
    'scene.undo': Edited;
    'scene.redo': Edited;
    'scene.revert': Edited;
    'timeline.get': { moments: readonly Moment[]; first_rev: number; scene_rev: number };
    'preset.store': Edited;
    'preset.recall': Edited;
    'preset.stop': Edited;
    'asset.list': { assets: readonly { asset: string; bytes: number }[]; whole: boolean };
    'asset.photometry': PhotometryOfWeb & { warnings: readonly string[] };
    'session.list': { sessions: readonly { session: string; person: string; role: string; address: string; project: string | null }[] };
    'presence.set': JsonObject;
    'project.list': { projects: readonly ProjectListed[]; trash: readonly ProjectInTrash[]; scenes: readonly string[] };
    'project.create': { project: string };
    'project.rename': { project: string };
    'project.delete': { project: string };
    'project.restore': { project: string };
    'project.erase': { project: string };
    'version.list': { versions: readonly { version: string; name: string; kept_s: number }[] };
    'version.remove': { project: string };
}

export type Params = ToldParams & ParamsByExample;
export type Answers = ToldAnswers & AnswersByExample;

/** What the server tells without being asked. */
export interface Notifications {
    'scene.changed': {
        scene_rev: number;
        op_id?: string | null;
        user: string;
        ops: readonly JsonObject[];
        emits?: Readonly<Record<string, Partial<Emits> | null>>;
    };
    'import.progress': { id: string; stage: string; fraction: number };
    'report.progress': { stage: 'sensors' | 'picture' | 'illuminance'; done: number; of: number };
    'frame.stats': FrameStats;
    sensors: { sensors: readonly SensorValue[] };
    presence: { people: readonly PersonHere[] };
    'timeline.named': { scene_rev: number; name: string; user: string };
    'preset.fading': { id: string; fade_s: number; left_s: number };
    /** Before the answer to `session.hello`, again and again while that waits. */
    'project.opening': { project: string; stage: 'opening' | 'waiting'; waited_s: number };
    'session.closing': JsonObject;
}

/** What the scene was after an edit; of the first one nobody knows which. */
export interface Moment {
    scene_rev: number;
    at_ms?: number;
    name?: string;
    named_by?: string;
    did?: 'apply' | 'undo' | 'redo' | 'revert';
    user?: string;
    /** Of revert. */
    to?: number;
    joined?: number;
    changes?: readonly (readonly ['add' | 'set' | 'remove', string, string])[];
    n_changes?: number;
}

/** One who is in the scene. */
export interface PersonHere {
    session: string;
    person: string;
    role: 'view' | 'measure' | 'edit' | 'admin';
    camera: Required<CameraPose> | null;
    point: Vec3 | null;
}

/** Times are seconds of the Unix epoch. */
export interface ProjectListed {
    id: string;
    name: string;
    changed_s: number;
    open: boolean;
    people: readonly string[];
}
export type ProjectInTrash = Pick<ProjectListed, 'id' | 'name' | 'changed_s'> & { deleted_s: number };

/** The light of an object that shines. */
export interface Emits {
    flux_lm: number;
    material_flux_lm: number;
    luminance_cd_m2: number;
    area_m2: number;
    color: NonNullable<Light['color']>;
    centre: Vec3;
    sides: 'both' | 'front';
}

/** No method is missing, and none is made up. */
type Same<A, B> = [A] extends [B] ? ([B] extends [A] ? true : never) : never;
export const complete: [Same<keyof Params, Method>, Same<keyof Answers, Method>] = [true, true];
