import { useApp } from './context';

/** The sections of the panel, which is longer than a screen: heading by id, and a short name. */
const SECTIONS: [string, string][] = [
    ['lights-title', 'Lights'],
    ['presets-title', 'Presets'],
    ['library-title', 'Luminaires'],
    ['material-title', 'Material'],
    ['daylight-title', 'Daylight'],
    ['sensors-title', 'Measure'],
    ['view-title', 'Picture'],
    ['compare-title', 'Compare'],
    ['accuracy-title', 'Accuracy'],
    ['import-title', 'Models'],
    ['desk-title', 'Desk'],
];

/** True where the server listens to a desk, or the scene has patches. */
export function useDeskIsShown(): boolean {
    const app = useApp();
    return app.desk.status.value !== null || app.scene.list('patch').value.length > 0;
}

/** Goes to a section: its heading takes the focus, so that the Tab key goes on from there. */
export function goTo(id: string): void {
    const title = document.getElementById(id);
    if (!title) return;
    title.tabIndex = -1;
    title.focus({ preventScroll: true });
    title.closest('section')?.scrollIntoView({ block: 'start' });
}

export function SectionNav() {
    const desk = useDeskIsShown();
    const { mayEdit } = useApp();
    const isShown = (id: string): boolean => (desk || id !== 'desk-title') && (mayEdit.value || id !== 'library-title');
    return (
        <nav class="section-nav" aria-label="Sections of the panel">
            {SECTIONS.filter(([id]) => isShown(id)).map(([id, name]) => (
                <button key={id} type="button" onClick={() => goTo(id)}>
                    {name}
                </button>
            ))}
        </nav>
    );
}
