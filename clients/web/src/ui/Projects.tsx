import { useSignal } from '@preact/signals';
import type { ComponentChildren } from 'preact';
import { useLayoutEffect, useRef } from 'preact/hooks';
import { hrefOf, nameOfCopy, peopleIn, type Project, type Trashed, type Version } from '../state/projects';
import { Banner } from './Banner';
import { Choice } from './Choice';
import { useApp } from './context';
import { Editing } from './Editing';
import { Icon } from './Icon';

/** In place of a scene: which there are. */
export function StartPage() {
    const { projects, connection } = useApp();
    if (!projects.atStart.value) return null;
    return (
        <main class="start" aria-labelledby="start-title">
            {connection.value.at !== 'online' && <Banner />}
            <div class="start-body" inert={connection.value.at !== 'online'}>
                <h2 id="start-title">Projects</h2>
                {projects.problem.value && (
                    <p class="problem" role="alert">
                        {projects.problem.value}
                    </p>
                )}
                <ProjectList />
            </div>
        </main>
    );
}

/** The same over a scene. */
export function ProjectsDialog() {
    const app = useApp();
    const { projects } = app;
    const dialog = useRef<HTMLDialogElement>(null);
    const open = projects.dialog.value && projects.here.value !== null;
    useLayoutEffect(() => {
        if (open && !dialog.current?.open) dialog.current?.showModal();
        if (!open) dialog.current?.close();
    }, [open]);
    const close = (): void => {
        projects.dialog.value = false;
    };
    return (
        <dialog ref={dialog} class="help projects" aria-labelledby="projects-title" onClose={close} closedby="any">
            {open && (
                <div class="help-body">
                    <header>
                        <h2 id="projects-title">Projects</h2>
                        <button type="button" class="icon-button" aria-label="Close" onClick={close}>
                            <Icon name="close" />
                        </button>
                    </header>
                    <SaveAs />
                    <h3>All projects</h3>
                    <ProjectList />
                </div>
            )}
        </dialog>
    );
}

/** A text, and a button that does something with it. start: what it is while nobody has written anything. */
function NameForm(props: { label: string; placeholder?: string; start?: string; button: string; children?: ComponentChildren; onName(name: string): void }) {
    const written = useSignal<string | null>(null);
    const { busy } = useApp().projects;
    const name = written.value ?? props.start ?? '';
    return (
        <form
            class="project-form"
            onSubmit={(e) => {
                e.preventDefault();
                if (!name.trim() || busy.value) return;
                written.value = null;
                props.onName(name.trim());
            }}
        >
            <input type="text" required aria-label={props.label} placeholder={props.placeholder ?? ''} value={name} onInput={(e) => (written.value = e.currentTarget.value)} />
            {props.children}
            <button type="submit" class="button" disabled={busy.value}>
                {props.button}
            </button>
        </form>
    );
}

/** Of the scene that is shown. */
function SaveAs() {
    const { projects, downloads } = useApp();
    const here = projects.here.value!;
    const taken = new Set(projects.list.value.map((p) => p.name));
    return (
        <section class="project-here" aria-labelledby="project-here-title">
            <h3 id="project-here-title">{here.name}</h3>
            <p class="hint">Each change is saved at once. Save as begins another project with the scene as it is now, and goes on there.</p>
            <Editing>
                <NameForm label="Name of the copy" start={nameOfCopy(here.name, taken)} button="Save as" onName={(name) => void projects.saveAs(name, here.id)} />
            </Editing>
            <button type="button" class="button" onClick={() => void downloads.scene()}>
                Download the scene
            </button>
        </section>
    );
}

function ProjectList() {
    const { projects } = useApp();
    const list = projects.list.value;
    const gone = projects.gone.value;
    return (
        <>
            {gone && (
                <p class="project-gone" role="status">
                    <span>{gone.name} is in the trash.</span>
                    <button type="button" class="button" onClick={() => void projects.restore(gone)}>
                        Undo
                    </button>
                </p>
            )}
            {list.length === 0 && <p class="hint">There is none yet. Make one here.</p>}
            <ul class="project-list">
                {list.map((project) => (
                    <Row key={project.id} project={project} />
                ))}
            </ul>
            <Editing>
                <New />
            </Editing>
            <Trash />
        </>
    );
}

function New() {
    const { projects } = useApp();
    const scene = useSignal('');
    const options: [string, string][] = [['', 'nothing'], ...projects.scenes.value.map((s): [string, string] => [s, s])];
    return (
        <section aria-labelledby="new-project-title">
            <h3 id="new-project-title">New project</h3>
            <NameForm label="Name of a new project" placeholder="Name, like Foyer" button="Create" onName={(name) => void projects.create(name, scene.value)}>
                <Choice label="Begin with" value={scene.value} options={options} onChange={(v) => (scene.value = v)} />
            </NameForm>
        </section>
    );
}

const when = (s: number): string => new Date(s * 1000).toLocaleString(undefined, { dateStyle: 'medium', timeStyle: 'short' });

function Row({ project }: { project: Project }) {
    const { projects } = useApp();
    const open = useSignal(false);
    const isHere = projects.here.value?.id === project.id;
    const people = peopleIn(project, isHere);
    const toggle = (): void => {
        open.value = !open.value;
        if (open.value) void projects.loadVersions(project.id);
    };
    return (
        <li class={`project ${isHere ? 'is-here' : ''}`}>
            <div class="project-row">
                <a class="project-name" href={hrefOf(project.id)} aria-current={isHere ? 'page' : undefined}>
                    {project.name}
                </a>
                <span class="project-facts">
                    <span>{when(project.changedS)}</span>
                    {people && <span class="project-people">{people}</span>}
                </span>
                <button type="button" class="toggle is-quiet" aria-expanded={open.value} aria-label={`More of ${project.name}`} onClick={toggle}>
                    …
                </button>
            </div>
            {open.value && <More project={project} />}
        </li>
    );
}

function More({ project }: { project: Project }) {
    const { projects } = useApp();
    const used = project.people.length > 0;
    return (
        <div class="project-more">
            <Editing>
                <NameForm label={`Name of ${project.name}`} start={project.name} button="Rename" onName={(name) => void projects.rename(project, name)} />
                <div class="project-deeds">
                    <button type="button" class="button" disabled={projects.busy.value} onClick={() => void projects.duplicate(project)}>
                        Duplicate
                    </button>
                    <button type="button" class="button" disabled={used || projects.busy.value} title={used ? 'Somebody is in it: it can be deleted when everybody has left it' : undefined} onClick={() => void projects.remove(project)}>
                        Delete
                    </button>
                </div>
            </Editing>
            <Versions project={project} />
        </div>
    );
}

function Versions({ project }: { project: Project }) {
    const { projects } = useApp();
    const versions = projects.versions.value.get(project.id) ?? [];
    return (
        <>
            <h4>Versions</h4>
            {versions.length > 0 && (
                <ul class="versions">
                    {versions.map((version) => (
                        <VersionRow key={version.id} project={project} version={version} />
                    ))}
                </ul>
            )}
            <Editing>
                <NameForm label={`Name of a version of ${project.name}`} placeholder="Name, like Before the meeting" button="Keep as it is now" onName={(name) => void projects.keep(project.id, name)} />
            </Editing>
        </>
    );
}

function VersionRow({ project, version }: { project: Project; version: Version }) {
    const { projects } = useApp();
    return (
        <li>
            <span class="version-name">
                {version.name} <small>{when(version.keptS)}</small>
            </span>
            <Editing>
                <button type="button" class="button" aria-label={`New project of it: ${version.name}`} disabled={projects.busy.value} onClick={() => void projects.saveAs(`${project.name}, ${version.name}`, project.id, version.id)}>
                    New project of it
                </button>
                <button type="button" class="button" aria-label={`Remove ${version.name}`} disabled={projects.busy.value} onClick={() => void projects.forget(project.id, version)}>
                    Remove
                </button>
            </Editing>
        </li>
    );
}

/** What cannot be taken back is asked twice: the button that does it is not the one that has the focus. */
function Sure(props: { question: string; button: string; onYes(): void; onNo(): void }) {
    const { busy } = useApp().projects;
    const keep = useRef<HTMLButtonElement>(null);
    useLayoutEffect(() => keep.current?.focus(), []); // before a key that comes next
    const onKeyDown = (e: KeyboardEvent): void => {
        if (e.key !== 'Escape') return;
        e.preventDefault(); // the dialog around it stays
        e.stopPropagation();
        props.onNo();
    };
    return (
        <div class="sure" role="group" aria-label={props.question} onKeyDown={onKeyDown}>
            <span role="alert">{props.question} Nothing brings it back.</span>
            <button type="button" class="button" disabled={busy.value} onClick={props.onYes}>
                {props.button}
            </button>
            <button type="button" class="button" ref={keep} onClick={props.onNo}>
                Keep
            </button>
        </div>
    );
}

const ALL = '';

function Trash() {
    const { projects } = useApp();
    const root = useRef<HTMLDetailsElement>(null);
    /** Whose end was asked for. */
    const asked = useSignal<string | null>(null);
    const list = projects.trash.value;
    const busy = projects.busy.value;
    if (list.length === 0) return null;
    /** Where the focus was is another button now, or nothing: it goes to the first of these that is there. Drawn is what
     * changed in a microtask, which was asked for before this one; a key that comes next finds the focus where it belongs. */
    const focus = (around: HTMLElement | null | undefined, ...wanted: string[]): void => {
        queueMicrotask(() => wanted.map((one) => around?.querySelector<HTMLElement>(one)).find((found) => found)?.focus());
    };
    const no = (label: string): void => {
        asked.value = null;
        focus(root.current, `[aria-label="${CSS.escape(label)}"]`, 'summary');
    };
    const yes = async (deed: Promise<void>): Promise<void> => {
        const around = root.current?.parentElement; // which stays when the trash is empty
        asked.value = null;
        focus(around, 'summary');
        await deed;
        focus(around, 'summary', '.project-name', 'input');
    };
    const forEver = (one: Trashed): string => `Delete for ever: ${one.name}`;
    return (
        <details class="project-trash" ref={root}>
            <summary>Trash ({list.length})</summary>
            <p class="hint">What is here is removed a month after it was deleted.</p>
            <ul class="versions">
                {list.map((one) => (
                    <li key={one.id}>
                        <span class="version-name">
                            {one.name} <small>deleted {when(one.deletedS)}</small>
                        </span>
                        <Editing>
                            {asked.value === one.id ? (
                                <Sure question={`Delete ${one.name} for ever?`} button="Delete for ever" onYes={() => void yes(projects.erase(one))} onNo={() => no(forEver(one))} />
                            ) : (
                                <>
                                    <button type="button" class="button" aria-label={`Bring back ${one.name}`} disabled={busy} onClick={() => void projects.restore(one)}>
                                        Bring back
                                    </button>
                                    <button type="button" class="button" aria-label={forEver(one)} disabled={busy} onClick={() => (asked.value = one.id)}>
                                        Delete for ever
                                    </button>
                                </>
                            )}
                        </Editing>
                    </li>
                ))}
            </ul>
            <Editing>
                {asked.value === ALL ? (
                    <Sure question="Delete all that is in the trash for ever?" button="Empty trash" onYes={() => void yes(projects.emptyTrash())} onNo={() => no('Empty trash')} />
                ) : (
                    <button type="button" class="button" aria-label="Empty trash" disabled={busy} onClick={() => (asked.value = ALL)}>
                        Empty trash
                    </button>
                )}
            </Editing>
        </details>
    );
}
