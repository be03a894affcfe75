import type { ComponentChildren } from 'preact';
import { useApp } from './context';
import { Icon } from './Icon';
import { useTheme } from './theme';

export function TopBar() {
    const app = useApp();
    const theme = useTheme();
    const state = app.connection.value.at;
    return (
        <header class="topbar">
            <Logo />
            <span class={`link link-${state}`}>
                <span class="link-dot" aria-hidden="true" />
                <span class="link-text">{state === 'online' ? 'connected' : state === 'refused' ? 'locked' : 'offline'}</span>
            </span>
            <nav class="tools" aria-label="Tools">
                <Tool label="Undo (Z)" onClick={() => void app.edits.undo()}>
                    <Icon name="undo" />
                </Tool>
                <Tool label="Redo (Shift+Z)" onClick={() => void app.edits.redo()}>
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
                <span class="gap" />
                <Tool label="High contrast" pressed={theme.contrast} onClick={theme.toggle}>
                    <Icon name="contrast" />
                </Tool>
                <Tool label="Keys and gestures (?)" onClick={() => (app.helpOpen.value = true)}>
                    <Icon name="help" />
                </Tool>
            </nav>
        </header>
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
    onClick(): void;
    children: ComponentChildren;
}

function Tool({ label, pressed, onClick, children }: ToolProps) {
    return (
        <button type="button" class="icon-button" aria-label={label} title={label} aria-pressed={pressed} onClick={onClick}>
            {children}
        </button>
    );
}
