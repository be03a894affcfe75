import { useEffect } from 'preact/hooks';
import { AccuracyPanel } from './AccuracyPanel';
import { ComparePanel } from './ComparePanel';
import { useApp } from './context';
import { DaylightPanel } from './DaylightPanel';
import { DeskPanel } from './DeskPanel';
import { DropFiles } from './DropFiles';
import { EffectsPanel } from './EffectsPanel';
import { HelpDialog } from './HelpDialog';
import { ImportPanel } from './ImportPanel';
import { handleKey } from './keymap';
import { DragGhost, LibraryPanel } from './LibraryPanel';
import { LightList } from './LightList';
import { MaterialPanel } from './MaterialPanel';
import { PeoplePanel } from './PeoplePanel';
import { PresetPanel } from './PresetPanel';
import { ProjectsDialog, StartPage } from './Projects';
import { SectionNav } from './SectionNav';
import { SensorPanel } from './SensorPanel';
import { StatusBar } from './StatusBar';
import { Toasts } from './Toasts';
import { TopBar } from './TopBar';
import { ViewPanel } from './ViewPanel';
import { Viewport } from './Viewport';

export function Layout() {
    const app = useApp();
    useEffect(() => {
        const onKey = (e: KeyboardEvent): void => {
            if (!app.helpOpen.value && !app.projects.shown.value && handleKey(app, e)) e.preventDefault();
        };
        document.addEventListener('keydown', onKey);
        return () => document.removeEventListener('keydown', onKey);
    }, []);
    return (
        <div class={`layout ${app.projects.atStart.value ? 'at-start' : ''}`}>
            <TopBar />
            <Viewport />
            <div class="panel" inert={app.connection.value.at !== 'online'}>
                <SectionNav />
                <div class="sections">
                    <PeoplePanel />
                    <LightList />
                    <PresetPanel />
                    <LibraryPanel />
                    <MaterialPanel />
                    <DaylightPanel />
                    <SensorPanel />
                    <DeskPanel />
                    <ViewPanel />
                    <ComparePanel />
                    <AccuracyPanel />
                    <EffectsPanel />
                    <ImportPanel />
                </div>
            </div>
            <StatusBar />
            <StartPage />
            <Toasts />
            <HelpDialog />
            <ProjectsDialog />
            <DragGhost />
            <DropFiles />
        </div>
    );
}
