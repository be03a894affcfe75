import type { ComponentChildren } from 'preact';
import { NOT_TO_EDIT } from '../state/role';
import { useApp } from './context';
import { Icon } from './Icon';
import { useTheme } from './theme';

const LINK_WORDS = { online: 'connected', stalled: 'no answer', refused: 'locked', connecting: 'offline', opening: 'opening', waiting: 'offline', ended: 'sent away' } as const;

export function TopBar() {
    const app = useApp();
    const theme = useTheme();
    const { at } = app.connection.value;
    const state = app.stalled.value ? 'stalled' : at;
    const atStart = app.projects.atStart.value;
    return (
        <header class="topbar">
            <Logo />
            <span class={`link link-${state}`}>
                <span class="link-dot" aria-hidden="true" />
                <span class="link-text">{LINK_WORDS[state]}</span>
            </span>
            {app.projects.here.value && <Here />}
            {state === 'online' && !atStart && <Kept />}
            {state === 'online' && !app.mayEdit.value && (
                <span class="kept" title={NOT_TO_EDIT}>
                    {app.mayMeasure.value ? 'to measure' : 'to look'}
                </span>
            )}
            <nav class="tools" aria-label="Tools">
                {!atStart && <SceneTools />}
                <Tool label="High contrast" pressed={theme.contrast} onClick={theme.toggle}>
                    <Icon name="contrast" />
                </Tool>
                {!atStart && (
                    <Tool label="Keys and gestures (?)" onClick={() => (app.helpOpen.value = true)}>
                        <Icon name="help" />
                    </Tool>
                )}
            </nav>
        </header>
    );
}

/** Whose scene this is; it opens the list of all. */
function Here() {
    const { projects } = useApp();
    const { name } = projects.here.value!;
    return (
        <button type="button" class="toggle is-quiet project-here-name" title={`${name}: all projects`} aria-haspopup="dialog" onClick={() => projects.open()}>
            {name}
        </button>
    );
}

function SceneTools() {
    const app = useApp();
    return (
        <>
            <Tool label="Undo (Z)" disabled={!app.mayEdit.value} onClick={() => void app.undo()}>
                <Icon name="undo" />
            </Tool>
            <Tool label="Redo (Shift+Z)" disabled={!app.mayEdit.value} onClick={() => void app.redo()}>
                <Icon name="redo" />
            </Tool>
            <span class="gap" />
            <Tool label="Frame what is selected (F)" onClick={() => app.frameSelection()}>
                <Icon name="frame" />
            </Tool>
            <Tool label="Back to the scene’s camera (H)" onClick={() => app.goHome()}>
                <Icon name="home" />
            </Tool>
            <Tool
                label="Lamp markers (L)"
                pressed={app.markers.value}
                onClick={() => (app.markers.value = !app.markers.value)}
            >
                <Icon name="lamp" />
            </Tool>
            <Tool label="Snapping (X)" pressed={app.snap.on.value} disabled={!app.mayEdit.value} onClick={() => (app.snap.on.value = !app.snap.on.value)}>
                <Icon name="snap" />
            </Tool>
            <Tool label="Download the scene" onClick={() => void app.downloads.scene()}>
                <Icon name="save" />
            </Tool>
            <Tool
                label="Download as glTF"
                disabled={!app.mayEdit.value}
                onClick={() => void app.downloads.model()}
            >
                <Icon name="model" />
            </Tool>
            <span class="gap" />
        </>
    );
}

/** Is what was changed safe, should the server stop? */
function Kept() {
    const app = useApp();
    if (!app.kept.value)
        return (
            <span class="kept" title="The server keeps no copy: when it stops, the scene is gone. Download it, or start the server with --state DIR">
                not saved
            </span>
        );
    return (
        <span class="kept" title="Each change is on the server’s disk, and is there again when it comes back">
            {app.edits.busy.value ? 'saving…' : 'saved'}
        </span>
    );
}

function Logo() {
    return (
        <h1 class="logo">
            <svg viewBox="0 0 20 20" aria-hidden="true">
                <path class="logo-beam" d="M10 4 17 17H3z" />
                <circle class="logo-lamp" cx="10" cy="5" r="3" />
                <path class="logo-floor" d="M3 17h14" />
            </svg>
            <span>lumend</span>
        </h1>
    );
}

interface ToolProps {
    label: string;
    pressed?: boolean;
    /** It changes the scene, and this client may not. */
    disabled?: boolean;
    onClick(): void;
    children: ComponentChildren;
}

function Tool({ label, pressed, disabled, onClick, children }: ToolProps) {
    const title = disabled ? `${label}. ${NOT_TO_EDIT}` : label;
    return (
        <button type="button" class="icon-button" aria-label={label} title={title} aria-pressed={pressed} disabled={disabled} onClick={onClick}>
            {children}
        </button>
    );
}
