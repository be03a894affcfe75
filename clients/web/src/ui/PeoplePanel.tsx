import '../style/people.css';
import { orbitFromPose } from '../view/camera';
import { useApp } from './context';

const ROLES = { view: 'looks', measure: 'measures', edit: 'edits', admin: 'edits, administers' } as const;

/** Who else is in the scene. */
export function PeoplePanel() {
    const app = useApp();
    const others = app.people.others.value;
    if (others.length === 0) return null;
    return (
        <section class="section docked people-panel" aria-labelledby="people-title">
            <h2 id="people-title">People</h2>
            <ul class="people">
                {others.map((p) => (
                    <li key={p.session}>
                        <svg class="person-mark" viewBox="0 0 16 16" aria-hidden="true" style={{ color: p.colour }}>
                            <path d="M2 4 14 8 2 12z" />
                        </svg>
                        <b style={{ color: p.colour }}>{p.name}</b>
                        <small>{ROLES[p.role]}</small>
                        <button
                            type="button"
                            class="toggle at-end"
                            aria-label={`Their view: look from where ${p.name} stands`}
                            disabled={p.camera === null}
                            onClick={() => p.camera && app.view.moveTo(orbitFromPose(p.camera))}
                        >
                            Their view
                        </button>
                    </li>
                ))}
            </ul>
        </section>
    );
}
