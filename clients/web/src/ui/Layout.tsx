import { useEffect } from 'preact/hooks';
import { AccuracyPanel } from './AccuracyPanel';
import { ComparePanel } from './ComparePanel';
import { useApp } from './context';
import { DaylightPanel } from './DaylightPanel';
import { DropFiles } from './DropFiles';
import { EffectsPanel } from './EffectsPanel';
import { ImportPanel } from './ImportPanel';
import { handleKey } from './keymap';
import { Lazy } from './Lazy';
import { DragGhost, LibraryPanel } from './LibraryPanel';
import { LightList } from './LightList';
import { MaterialPanel } from './MaterialPanel';
import { PresetPanel } from './PresetPanel';
import { SectionNav, useDeskIsShown } from './SectionNav';
import { SensorPanel } from './SensorPanel';
import { StatusBar } from './StatusBar';
import { Toasts } from './Toasts';
import { TopBar } from './TopBar';
import { ViewPanel } from './ViewPanel';
import { Viewport } from './Viewport';

const peoplePanel = () => import('./PeoplePanel').then((m) => m.PeoplePanel);
const selectionPanel = () => import('./SelectionPanel').then((m) => m.SelectionPanel);
const startPage = () => import('./Projects').then((m) => m.StartPage);
const projectsDialog = () => import('./Projects').then((m) => m.ProjectsDialog);
const timelineBar = () => import('./TimelineBar').then((m) => m.TimelineBar);
const deskPanel = () => import('./DeskPanel').then((m) => m.DeskPanel);
const helpDialog = () => import('./HelpDialog').then((m) => m.HelpDialog);

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
                <Lazy when={app.selection.many.value.length > 0} load={selectionPanel} with={{}} />
                <Lazy when={app.people.others.value.length > 0} load={peoplePanel} with={{}} />
                <div class="sections">
                    <LightList />
                    <PresetPanel />
                    <LibraryPanel />
                    <MaterialPanel />
                    <DaylightPanel />
                    <SensorPanel />
                    <Lazy when={useDeskIsShown()} load={deskPanel} with={{}} />
                    <ViewPanel />
                    <ComparePanel />
                    <AccuracyPanel />
                    <EffectsPanel />
                    <ImportPanel />
                </div>
            </div>
            <Lazy when={app.pastOpen.value} load={timelineBar} with={{}} />
            <StatusBar />
            <Lazy when={app.projects.atStart.value} load={startPage} with={{}} />
            <Toasts />
            <Lazy when={app.helpOpen.value} load={helpDialog} with={{}} />
            <Lazy when={app.projects.shown.value} load={projectsDialog} with={{}} />
            <DragGhost />
            <DropFiles />
        </div>
    );
}
