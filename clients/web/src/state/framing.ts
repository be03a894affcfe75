/** Cameras that show one thing whole. */
import { length, scale, sub, type Vec3 } from '../lib/vec';
import type { JsonObject } from '../protocol/rpc';
import { vec3Or, type SceneRecord } from '../protocol/types';
import { frameBall, poseFromOrbit } from '../view/camera';
import { centreOf, extentOf, isPlaced } from './lights';
import type { ViewLink } from './view';

/** Metres: of what has no extent. */
const LEAST = 0.05;
/** Of the distance to a point that is looked at closely. */
const CLOSE = 0.12;

export interface FramingHost {
    view: ViewLink;
    call(method: string, params: JsonObject): Promise<JsonObject>;
    onError(error: Error): void;
    /** Ids of cameras. */
    cameras(): readonly string[];
    goToCamera(id: string): void;
}

export class Framing {
    constructor(private readonly host: FramingHost) {}

    /** An object, or all that an import brought: as its own camera shows it, for a room is best seen from inside. */
    async record(id: string): Promise<void> {
        const { call, onError, cameras, goToCamera } = this.host;
        const camera = cameras().find((c) => c.startsWith(`${id}/`));
        if (camera) {
            goToCamera(camera);
            return;
        }
        const box = await call('bounds', { id }).catch(onError);
        if (!box) return;
        const [lo, hi] = [vec3Or(box.min, [0, 0, 0]), vec3Or(box.max, [0, 0, 0])];
        this.ball(scale([lo[0] + hi[0], lo[1] + hi[1], lo[2] + hi[2]], 0.5), Math.max(LEAST, length(sub(hi, lo)) / 2));
    }

    /** True: the lamp stands somewhere. */
    lamp(light: SceneRecord | undefined): boolean {
        if (!light || !isPlaced(light)) return false;
        this.ball(centreOf(light), 3 * extentOf(light));
        return true;
    }

    point(point: Vec3): void {
        this.ball(point, Math.max(LEAST, CLOSE * length(sub(point, poseFromOrbit(this.host.view.orbit.value).position))));
    }

    private ball(centre: Vec3, radius: number): void {
        const { view } = this.host;
        view.moveTo(frameBall(view.orbit.value, centre, radius, view.aspect.value));
    }
}
