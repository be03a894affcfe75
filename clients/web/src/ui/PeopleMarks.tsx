import { add, scale, sub, length, type Vec3 } from '../lib/vec';
import type { Person } from '../state/people';
import '../style/people.css';
import { basis, project } from '../view/camera';
import { useApp } from './context';

/** Of what is drawn of a camera, of the distance from which it is seen: near or far it is as large. */
const SIZE = 0.05;

/** Where others stand, and what they point at. The panel "People" has their names, and goes where they stand; what they point at is here alone. */
export function PeopleMarks() {
    const { others } = useApp().people;
    return (
        <g class="people-marks" aria-hidden="true">
            {others.value.map((p) => (
                <Marks key={p.session} person={p} />
            ))}
        </g>
    );
}

function Marks({ person: { camera, point, name, colour } }: { person: Person }) {
    const app = useApp();
    const pose = app.view.shownPose.value;
    const [w, h] = app.view.cssSize.value;
    const place = (p: Vec3): { x: number; y: number } | null => {
        const at = project(pose, app.view.aspect.value, p);
        return at && { x: at.x * w, y: at.y * h };
    };
    const eye = camera && place(camera.position);
    const aim = point && place(point);
    const far = camera ? length(sub(camera.position, pose.position)) : 0;
    const rim = camera && far > 0 ? frustum(camera, SIZE * far).map(place) : [];
    return (
        <g style={{ color: colour }}>
            {eye && rim.every((r) => r !== null) && rim.length > 0 && (
                <>
                    <path class="person-eye" d={`${rim.map((r) => `M${eye.x} ${eye.y}L${r.x} ${r.y}`).join('')}M${rim.map((r) => `${r.x} ${r.y}`).join('L')}Z`} />
                    <text x={eye.x} y={eye.y - 8} text-anchor="middle">
                        {name}
                    </text>
                </>
            )}
            {aim && (
                <g transform={`translate(${aim.x.toFixed(1)} ${aim.y.toFixed(1)})`}>
                    <path class="person-point" d="M0 0 4 13 7 8 13 6z" />
                    <text x="12" y="22">
                        {name}
                    </text>
                </g>
            )}
        </g>
    );
}

/** The four corners of what it sees, at that distance. */
function frustum(camera: NonNullable<Person['camera']>, distance: number): Vec3[] {
    const { right, up, forward } = basis(camera);
    const middle = add(camera.position, scale(forward, distance));
    const half = distance * Math.tan((camera.vfov_deg * Math.PI) / 360);
    return ([[-1, -1], [1, -1], [1, 1], [-1, 1]] as const).map(([x, y]) => add(middle, add(scale(right, 1.3 * half * x), scale(up, half * y))));
}
