<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de">
<context>
    <name>BoneView</name>
    <message>
        <source>Receiving the surface, %1 %</source>
        <translation>Oberfläche wird empfangen, %1 %</translation>
    </message>
</context>
<context>
    <name>CArmPanel</name>
    <message>
        <source>The last picture</source>
        <translation>Das letzte Bild</translation>
    </message>
    <message>
        <source>The picture before it</source>
        <translation>Das Bild davor</translation>
    </message>
    <message>
        <source>Shot</source>
        <translation>Aufnahme</translation>
    </message>
    <message>
        <source>One X-ray picture (F7)</source>
        <translation>Ein Röntgenbild (F7)</translation>
    </message>
    <message>
        <source>Pulse</source>
        <translation>Gepulst</translation>
    </message>
    <message>
        <source>Hold it: %1 pictures a second (F8)</source>
        <translation>Halten: %1 Bilder in der Sekunde (F8)</translation>
    </message>
    <message>
        <source>Live</source>
        <translation>Dauernd</translation>
    </message>
    <message>
        <source>Hold it: X-rays all the time (F9)</source>
        <translation>Halten: Röntgenstrahlung die ganze Zeit (F9)</translation>
    </message>
    <message>
        <source>Save…</source>
        <translation>Speichern…</translation>
    </message>
    <message>
        <source>AP</source>
        <translation>a.-p.</translation>
    </message>
    <message>
        <source>Anteroposterior: the tube behind the patient</source>
        <translation>Anterior-posterior: die Röhre hinter dem Patienten</translation>
    </message>
    <message>
        <source>Lateral</source>
        <translation>Seitlich</translation>
    </message>
    <message>
        <source>From the side</source>
        <translation>Von der Seite</translation>
    </message>
    <message>
        <source>Axial</source>
        <translation>Axial</translation>
    </message>
    <message>
        <source>Along the patient</source>
        <translation>Längs des Patienten</translation>
    </message>
    <message>
        <source>Bone in the middle</source>
        <translation>Knochen in die Mitte</translation>
    </message>
    <message>
        <source>The arm turns about the middle of the bone</source>
        <translation>Der Bogen dreht sich um die Mitte des Knochens</translation>
    </message>
    <message>
        <source>Tip in the middle</source>
        <translation>Spitze in die Mitte</translation>
    </message>
    <message>
        <source>The arm turns about the tip of your tool</source>
        <translation>Der Bogen dreht sich um die Spitze Ihres Werkzeugs</translation>
    </message>
    <message>
        <source>Kind of picture</source>
        <translation>Art des Bildes</translation>
    </message>
    <message>
        <source>X-ray</source>
        <translation>Röntgen</translation>
    </message>
    <message>
        <source>Maximum intensity</source>
        <translation>Maximumintensität</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>Orbit</source>
        <translation>Drehung</translation>
    </message>
    <message>
        <source>Tilt</source>
        <translation>Kippung</translation>
    </message>
    <message>
        <source>To the left</source>
        <translation>Nach links</translation>
    </message>
    <message>
        <source>To the back</source>
        <translation>Nach hinten</translation>
    </message>
    <message>
        <source>To the head</source>
        <translation>Zum Kopf</translation>
    </message>
    <message>
        <source>%1: at most %2 to either side</source>
        <translation>%1: höchstens %2 zu jeder Seite</translation>
    </message>
    <message>
        <source>Shots</source>
        <translation>Aufnahmen</translation>
    </message>
    <message>
        <source>Exposure</source>
        <translation>Strahlzeit</translation>
    </message>
    <message>
        <source>Dose-area product</source>
        <translation>Dosisflächenprodukt</translation>
    </message>
    <message>
        <source>%1 s</source>
        <translation>%1 s</translation>
    </message>
    <message>
        <source>%1 Gy cm²</source>
        <translation>%1 Gy cm²</translation>
    </message>
    <message>
        <source>Open a bone or join a room first.</source>
        <translation>Öffnen Sie erst einen Knochen, oder betreten Sie einen Raum.</translation>
    </message>
    <message>
        <source>The inside of the bone is on its way.</source>
        <translation>Das Innere des Knochens ist unterwegs.</translation>
    </message>
    <message>
        <source>The inside of the bone is computed: %1 %</source>
        <translation>Das Innere des Knochens wird berechnet: %1 %</translation>
    </message>
    <message>
        <source>The inside of the bone is not there.</source>
        <translation>Das Innere des Knochens ist nicht da.</translation>
    </message>
    <message>
        <source>The connection is lost. Pictures show the bone as it was.</source>
        <translation>Die Verbindung ist verloren. Die Bilder zeigen den Knochen, wie er war.</translation>
    </message>
    <message>
        <source>There is no picture yet.</source>
        <translation>Es gibt noch kein Bild.</translation>
    </message>
    <message>
        <source>Save the X-ray picture</source>
        <translation>Röntgenbild speichern</translation>
    </message>
    <message>
        <source>Pictures (*.png)</source>
        <translation>Bilder (*.png)</translation>
    </message>
    <message>
        <source>Saved %1.</source>
        <translation>%1 ist gespeichert.</translation>
    </message>
    <message>
        <source>Your hand holds no tool. Take one first.</source>
        <translation>Ihre Hand hält kein Werkzeug. Nehmen Sie erst eines.</translation>
    </message>
    <message>
        <source>Maximum intensity: the densest bone on each ray, without X-rays</source>
        <translation>Der dichteste Knochen auf jedem Strahl, ohne Röntgenstrahlung</translation>
    </message>
    <message>
        <source>Maximum intensity needs no X-rays. Choose X-ray first.</source>
        <translation>Maximumintensität braucht keine Strahlung. Wählen Sie dazu Röntgen.</translation>
    </message>
    <message>
        <source>Nominal: it follows from the setting of the tube alone.</source>
        <translation>Nominal: Es folgt allein aus der Einstellung der Röhre.</translation>
    </message>
    <message>
        <source>It is no dose of a person.</source>
        <translation>Es ist keine Dosis eines Menschen.</translation>
    </message>
    <message>
        <source>Saves the picture that is shown as a PNG file</source>
        <translation>Speichert das gezeigte Bild als PNG-Datei</translation>
    </message>
    <message>
        <source>%1: made again from the bone and the tools as they were at %2.</source>
        <translation>%1: neu berechnet aus Knochen und Werkzeugen, wie sie um %2 waren.</translation>
    </message>
    <message>
        <source>The room has no picture of this person any more.</source>
        <translation>Der Raum hat kein Bild dieser Person mehr.</translation>
    </message>
    <message>
        <source>You are an observer: the others do not see your shots.</source>
        <translation>Sie sind Beobachter: Die anderen sehen Ihre Aufnahmen nicht.</translation>
    </message>
    <message>
        <source>The others do not see your shots: %1</source>
        <translation>Die anderen sehen Ihre Aufnahmen nicht: %1</translation>
    </message>
    <message>
        <source>A picture of another person</source>
        <translation>Ein Bild eines anderen</translation>
    </message>
</context>
<context>
    <name>CArmScreen</name>
    <message>
        <source>No picture yet</source>
        <translation>Noch kein Bild</translation>
    </message>
    <message>
        <source>%1: left %2, right %3, top %4, bottom %5</source>
        <translation>%1: links %2, rechts %3, oben %4, unten %5</translation>
    </message>
</context>
<context>
    <name>CaseMaker</name>
    <message>
        <source>osteon-import ended without a case.</source>
        <translation>osteon-import endete ohne einen Fall.</translation>
    </message>
</context>
<context>
    <name>CaseSending</name>
    <message>
        <source>Cancelled. A server that had already checked the case may have it.</source>
        <translation>Abgebrochen. Hatte der Server den Fall schon geprüft, hat er ihn vielleicht.</translation>
    </message>
    <message>
        <source>Cannot make the folder %1. Choose a place where you may write.</source>
        <translation>Der Ordner %1 kann nicht angelegt werden. Wählen Sie einen beschreibbaren Ort.</translation>
    </message>
    <message>
        <source>%1 had the case already.</source>
        <translation>%1 hatte den Fall schon.</translation>
    </message>
    <message>
        <source>%1 has the case now.</source>
        <translation>%1 hat den Fall nun.</translation>
    </message>
    <message>
        <source>%1 has the case, and the room %2 is open with it.</source>
        <translation>%1 hat den Fall, und der Raum %2 ist damit offen.</translation>
    </message>
    <message>
        <source>Cancelled. %1 has the case, and the room may be open.</source>
        <translation>Abgebrochen. %1 hat den Fall, und der Raum ist vielleicht offen.</translation>
    </message>
    <message>
        <source>%1 has the case, but did not open the room: %2</source>
        <translation>%1 hat den Fall, aber der Raum wurde nicht geöffnet: %2</translation>
    </message>
</context>
<context>
    <name>ChildProcess</name>
    <message>
        <source>The disk with %1 is full; make room on the disk.</source>
        <translation>Der Datenträger mit %1 ist voll; schaffen Sie dort Platz.</translation>
    </message>
</context>
<context>
    <name>ClippingPanel</name>
    <message>
        <source>A box</source>
        <translation>Ein Quader</translation>
    </message>
    <message>
        <source>Right</source>
        <translation>Rechts</translation>
    </message>
    <message>
        <source>Left</source>
        <translation>Links</translation>
    </message>
    <message>
        <source>Front</source>
        <translation>Vorn</translation>
    </message>
    <message>
        <source>Back</source>
        <translation>Hinten</translation>
    </message>
    <message>
        <source>Foot</source>
        <translation>Fuß</translation>
    </message>
    <message>
        <source>Head</source>
        <translation>Kopf</translation>
    </message>
    <message>
        <source>A plane</source>
        <translation>Eine Ebene</translation>
    </message>
    <message>
        <source>Depth</source>
        <translation>Tiefe</translation>
    </message>
    <message>
        <source>Turn the plane to me</source>
        <translation>Ebene zu mir drehen</translation>
    </message>
    <message>
        <source>Whole bone</source>
        <translation>Ganzer Knochen</translation>
    </message>
</context>
<context>
    <name>ConnectionPanel</name>
    <message>
        <source>%1 ms</source>
        <translation>%1 ms</translation>
    </message>
    <message>
        <source>not started</source>
        <translation>nicht gestartet</translation>
    </message>
    <message>
        <source>starts again</source>
        <translation>startet wieder</translation>
    </message>
    <message>
        <source>ended</source>
        <translation>beendet</translation>
    </message>
    <message>
        <source>runs</source>
        <translation>läuft</translation>
    </message>
    <message>
        <source>not connected</source>
        <translation>nicht verbunden</translation>
    </message>
    <message>
        <source>connection lost, trying again</source>
        <translation>Verbindung verloren, neuer Versuch</translation>
    </message>
    <message>
        <source>answers in %1</source>
        <translation>antwortet in %1</translation>
    </message>
    <message>
        <source>connected</source>
        <translation>verbunden</translation>
    </message>
    <message>
        <source>not in this window</source>
        <translation>nicht in diesem Fenster</translation>
    </message>
    <message>
        <source>none</source>
        <translation>keines</translation>
    </message>
    <message>
        <source>mouse, not connected yet</source>
        <translation>Maus, noch nicht verbunden</translation>
    </message>
    <message>
        <source>mouse, makes its tools ready</source>
        <translation>Maus, bereitet die Werkzeuge vor</translation>
    </message>
    <message>
        <source>mouse, at %1, %2, %3 mm</source>
        <translation>Maus, bei %1, %2, %3 mm</translation>
    </message>
    <message>
        <source>switched off</source>
        <translation>ausgeschaltet</translation>
    </message>
    <message>
        <source>delay %1</source>
        <translation>%1 später</translation>
    </message>
    <message>
        <source>no device</source>
        <translation>kein Gerät</translation>
    </message>
    <message>
        <source>Open a bone or join a room.</source>
        <translation>Öffnen Sie einen Knochen oder betreten Sie einen Raum.</translation>
    </message>
    <message>
        <source>Check the network to %1. The window connects again by itself.</source>
        <translation>Prüfen Sie das Netz zu %1. Das Fenster verbindet sich von selbst wieder.</translation>
    </message>
    <message>
        <source>Wait some seconds: the haptic client makes its tools ready.</source>
        <translation>Warten Sie einige Sekunden: Das Haptikprogramm bereitet die Werkzeuge vor.</translation>
    </message>
    <message>
        <source>The haptic client is silent. Close other programs that use the processor.</source>
        <translation>Das Haptikprogramm schweigt. Beenden Sie, was den Rechner sonst auslastet.</translation>
    </message>
    <message>
        <source>No sound device: %1</source>
        <translation>Kein Tongerät: %1</translation>
    </message>
    <message>
        <source>Without loudspeakers, switch the sound off: Tools &gt; Sound.</source>
        <translation>Ohne Lautsprecher schalten Sie den Ton aus: Werkzeuge &gt; Ton.</translation>
    </message>
    <message>
        <source>You practise alone.</source>
        <translation>Sie üben allein.</translation>
    </message>
    <message>
        <source>You watch.</source>
        <translation>Sie sehen zu.</translation>
    </message>
    <message>
        <source>You joined this room as a viewer.</source>
        <translation>Sie sind Gast und sehen zu.</translation>
    </message>
    <message>
        <source>Room</source>
        <translation>Raum</translation>
    </message>
    <message>
        <source>Your role</source>
        <translation>Ihre Rolle</translation>
    </message>
    <message>
        <source>The server</source>
        <translation>Der Server</translation>
    </message>
    <message>
        <source>Haptic client</source>
        <translation>Haptikprogramm</translation>
    </message>
    <message>
        <source>Its device</source>
        <translation>Sein Gerät</translation>
    </message>
    <message>
        <source>Audio client</source>
        <translation>Tonprogramm</translation>
    </message>
    <message>
        <source>What to do</source>
        <translation>Was zu tun ist</translation>
    </message>
    <message>
        <source>%1 at %2</source>
        <translation>%1 auf %2</translation>
    </message>
    <message>
        <source>Nothing: everything works.</source>
        <translation>Nichts. Alles arbeitet.</translation>
    </message>
    <message>
        <source>started again: %1</source>
        <translation>neu gestartet: %1</translation>
    </message>
    <message>
        <source>last message %1 ms ago</source>
        <translation>gehört vor %1 ms</translation>
    </message>
</context>
<context>
    <name>Force</name>
    <message>
        <source>&amp;Proportional</source>
        <translation>&amp;Proportionale Kraft</translation>
    </message>
    <message>
        <source>All ratios of forces stay. A weak device hides weak forces.</source>
        <translation>Alle Kraftverhältnisse bleiben. Ein schwaches Gerät verbirgt schwache Kräfte.</translation>
    </message>
    <message>
        <source>&amp;Compressed</source>
        <translation>&amp;Komprimierte Kraft</translation>
    </message>
    <message>
        <source>&amp;Feed cue</source>
        <translation>&amp;Vibration nach dem Vorschub</translation>
    </message>
    <message>
        <source>A small force, and a vibration that grows with the feed.</source>
        <translation>Eine kleine Kraft und eine Vibration, die mit dem Vorschub wächst.</translation>
    </message>
    <message>
        <source>A logarithm: weak forces keep their ratios, strong ones come closer to each other.</source>
        <translation>Logarithmus: Schwache Kräfte behalten ihr Verhältnis, starke rücken zusammen.</translation>
    </message>
    <message>
        <source>The window&apos;s haptic client starts again: the tool leaves the bone for some seconds.</source>
        <translation>Das Haptikprogramm startet neu: Das Werkzeug ist einige Sekunden nicht im Knochen.</translation>
    </message>
    <message>
        <source>Other haptic clients have the option --force-choice.</source>
        <translation>Andere Haptikprogramme haben die Option --force-choice.</translation>
    </message>
</context>
<context>
    <name>GamePadController</name>
    <message>
        <source>The game pad</source>
        <translation>Das Gamepad</translation>
    </message>
    <message>
        <source>%1: choose a tool. The left stick moves it, the right trigger pushes.</source>
        <translation>%1: Wählen Sie ein Werkzeug. Linker Stick bewegt es, rechter Trigger drückt.</translation>
    </message>
    <message>
        <source>%1 was unplugged. It no longer leads the tool.</source>
        <translation>%1 ist nicht mehr angeschlossen. Es führt das Werkzeug nicht mehr.</translation>
    </message>
</context>
<context>
    <name>GaugesPanel</name>
    <message>
        <source>Push</source>
        <translation>Andruck</translation>
    </message>
    <message>
        <source>Force of the bone</source>
        <translation>Kraft des Knochens</translation>
    </message>
    <message>
        <source>Force on the hand</source>
        <translation>Kraft auf die Hand</translation>
    </message>
    <message>
        <source>Force on the hand, of what the device holds</source>
        <translation>Kraft auf die Hand, gemessen an dem, was das Gerät hält</translation>
    </message>
    <message>
        <source>The device cannot hold this force: the bone is harder than it feels.</source>
        <translation>Das Gerät hält diese Kraft nicht: Der Knochen ist härter, als er sich anfühlt.</translation>
    </message>
    <message>
        <source>Force of the bone: %1 N. On the hand: %2 N. The device can hold: %3 N.</source>
        <translation>Der Knochen gibt %1 N, die Hand bekommt %2 N, das Gerät hält %3 N.</translation>
    </message>
    <message>
        <source>Torque</source>
        <translation>Drehmoment</translation>
    </message>
    <message>
        <source>Depth</source>
        <translation>Eindringtiefe</translation>
    </message>
    <message>
        <source>Spindle</source>
        <translation>Drehzahl</translation>
    </message>
    <message>
        <source>Feed</source>
        <translation>Vorschub</translation>
    </message>
    <message>
        <source>Density</source>
        <translation>Dichte</translation>
    </message>
    <message>
        <source>%1 N</source>
        <translation>%1 N</translation>
    </message>
    <message>
        <source>%1 Nmm</source>
        <translation>%1 Nmm</translation>
    </message>
    <message>
        <source>%1 mm</source>
        <translation>%1 mm</translation>
    </message>
    <message>
        <source>%1 rpm</source>
        <translation>%1 U/min</translation>
    </message>
    <message>
        <source>%1 mm/s</source>
        <translation>%1 mm/s</translation>
    </message>
    <message>
        <source>%1 g/cm³</source>
        <translation>%1 g/cm³</translation>
    </message>
    <message>
        <source>bone</source>
        <translation>Knochen</translation>
    </message>
    <message>
        <source>hand</source>
        <translation>Hand</translation>
    </message>
    <message>
        <source>Flutes filled</source>
        <translation>Nuten gefüllt</translation>
    </message>
    <message>
        <source>%1 %</source>
        <translation>%1 %</translation>
    </message>
    <message>
        <source>Wear</source>
        <translation>Verschleiß</translation>
    </message>
    <message>
        <source>Temperature</source>
        <translation>Temperatur</translation>
    </message>
    <message>
        <source>not simulated</source>
        <translation>nicht simuliert</translation>
    </message>
    <message>
        <source>Angle to the plan</source>
        <translation>Winkel zum Plan</translation>
    </message>
    <message>
        <source>Beside the plan</source>
        <translation>Neben dem Plan</translation>
    </message>
    <message>
        <source>Depth left</source>
        <translation>Resttiefe</translation>
    </message>
    <message>
        <source>%1°</source>
        <translation>%1°</translation>
    </message>
</context>
<context>
    <name>ImagingBoneChoice</name>
    <message>
        <source>Bone of the tools</source>
        <translation>Knochen der Werkzeuge</translation>
    </message>
    <message>
        <source>The bone of the next seed, paint or cut. Seeds of one bone merge their parts.</source>
        <translation>Knochen für Saatpunkt, Pinsel, Schnitt. Saatpunkte eines Knochens vereinen Teile.</translation>
    </message>
    <message>
        <source>Bone</source>
        <translation>Knochen</translation>
    </message>
    <message>
        <source>Name of the bone</source>
        <translation>Name des Knochens</translation>
    </message>
    <message>
        <source>Name of the bone in the case, such as femur</source>
        <translation>Name des Knochens im Fall, etwa Femur</translation>
    </message>
    <message>
        <source>Opacity of its tint</source>
        <translation>Deckkraft seiner Farbe</translation>
    </message>
    <message>
        <source> %</source>
        <translation> %</translation>
    </message>
    <message>
        <source>new, or under the mouse</source>
        <translation>neu, oder unter der Maus</translation>
    </message>
    <message>
        <source>Choose a bone first.</source>
        <translation>Wählen Sie zuerst einen Knochen.</translation>
    </message>
    <message>
        <source>Its name</source>
        <translation>Sein Name</translation>
    </message>
</context>
<context>
    <name>ImagingBoxes</name>
    <message>
        <source>Nothing is kept. Keep a bone first.</source>
        <translation>Nichts wird behalten. Behalten Sie zuerst einen Knochen.</translation>
    </message>
    <message>
        <source>Bounding box: %1 × %2 × %3, %4 voxels, %5 % of the scan</source>
        <translation>Hüllquader: %1 × %2 × %3, %4 Voxel, %5 % des Scans</translation>
    </message>
    <message>
        <source>Section boxes: %1, %2 voxels, %3 % of the scan</source>
        <translation>Abschnittsquader: %1, %2 Voxel, %3 % des Scans</translation>
    </message>
    <message>
        <source>Leaves: %1, of which %2 are full and %3 partly full</source>
        <translation>Blätter: %1, davon %2 voll und %3 teilweise voll</translation>
    </message>
    <message>
        <source>Sub-volumes</source>
        <translation>Teilvolumen</translation>
    </message>
    <message>
        <source>Subdivisions of each section</source>
        <translation>Unterteilungen jedes Abschnitts</translation>
    </message>
    <message>
        <source>How often each section is divided into quadrants</source>
        <translation>Wie oft jeder Abschnitt in Quadranten geteilt wird</translation>
    </message>
    <message>
        <source>Yellow, dashed: bounding box. Blue: section boxes. Orange, wide: the chosen one.</source>
        <translation>Gelb, gestrichelt: Hüllquader. Blau: Abschnittsquader. Orange, breit: der gewählte.</translation>
    </message>
    <message>
        <source>Green: full leaves. Pink, dashed: leaves that are partly full.</source>
        <translation>Grün: volle Blätter. Rosa, gestrichelt: teilweise volle Blätter.</translation>
    </message>
    <message>
        <source>Section boxes</source>
        <translation>Abschnittsquader</translation>
    </message>
    <message>
        <source>Moves the crosshair into the section. A click on a plane chooses the one there.</source>
        <translation>Bringt das Fadenkreuz in den Abschnitt. Ein Klick auf eine Ebene wählt den dortigen.</translation>
    </message>
    <message>
        <source>Subdivisions</source>
        <translation>Unterteilungen</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>Schließen</translation>
    </message>
    <message>
        <source>&amp;Write root sub-volumes…</source>
        <translation>&amp;Wurzel-Teilvolumen schreiben…</translation>
    </message>
    <message>
        <source>Makes a folder with Meta.dat, SBB1.dat and so on, the report, and a picture of the boxes</source>
        <translation>Legt einen Ordner mit Meta.dat, SBB1.dat usw., Bericht und Bild der Quader an</translation>
    </message>
    <message>
        <source>The parts of bone are not known yet.</source>
        <translation>Die Knochenteile sind noch nicht bekannt.</translation>
    </message>
    <message>
        <source>Finding the boxes …</source>
        <translation>Die Quader werden gesucht …</translation>
    </message>
    <message>
        <source>This machine has no memory for the sub-volumes. Keep less.</source>
        <translation>Dem Rechner fehlt Speicher für die Teilvolumen. Behalten Sie weniger.</translation>
    </message>
    <message>
        <source>Never more than %1 are shown. Choose a section, or fewer subdivisions.</source>
        <translation>Nie sind mehr als %1 zu sehen. Wählen Sie Abschnitt oder weniger Unterteilungen.</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>Fortschritt</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>%1: %2 × %3 × %4, %5 % of the scan</source>
        <translation>%1: %2 × %3 × %4, %5 % des Scans</translation>
    </message>
    <message>
        <source>Where the folder of the sub-volumes is to be</source>
        <translation>Wo der Ordner der Teilvolumen liegen soll</translation>
    </message>
    <message>
        <source>There are no sub-volumes yet.</source>
        <translation>Es gibt noch keine Teilvolumen.</translation>
    </message>
    <message>
        <source>The files are being written. Wait for them, or cancel.</source>
        <translation>Die Dateien werden geschrieben. Warten Sie darauf oder brechen Sie ab.</translation>
    </message>
</context>
<context>
    <name>ImagingHistogram</name>
    <message>
        <source>Histogram of the HU</source>
        <translation>Histogramm der HU</translation>
    </message>
    <message>
        <source>Drag the orange threshold, or the blue ends of the window.</source>
        <translation>Ziehen Sie den orangen Schwellwert oder die blauen Enden des Fensters.</translation>
    </message>
</context>
<context>
    <name>ImagingLandmarks</name>
    <message>
        <source>Name of the next landmark</source>
        <translation>Name der nächsten Landmarke</translation>
    </message>
    <message>
        <source>Name of the landmark that the next click with Landmark sets. One that is there moves.</source>
        <translation>Name der Landmarke, die der nächste Klick mit Landmarke setzt oder verschiebt</translation>
    </message>
    <message>
        <source>Centre of the femoral head</source>
        <translation>Hüftkopfmitte</translation>
    </message>
    <message>
        <source>Greater trochanter</source>
        <translation>Großer Rollhügel</translation>
    </message>
    <message>
        <source>Medial epicondyle</source>
        <translation>Innerer Epikondylus</translation>
    </message>
    <message>
        <source>Lateral epicondyle</source>
        <translation>Äußerer Epikondylus</translation>
    </message>
    <message>
        <source>Tibial tuberosity</source>
        <translation>Schienbeinrauigkeit</translation>
    </message>
    <message>
        <source>Medial malleolus</source>
        <translation>Innenknöchel</translation>
    </message>
    <message>
        <source>Lateral malleolus</source>
        <translation>Außenknöchel</translation>
    </message>
    <message>
        <source>Anterior superior iliac spine</source>
        <translation>Vorderer oberer Darmbeinstachel</translation>
    </message>
    <message>
        <source>Pubic tubercle</source>
        <translation>Schambeinhöcker</translation>
    </message>
    <message>
        <source>Landmark</source>
        <translation>Landmarke</translation>
    </message>
    <message>
        <source>Landmarks</source>
        <translation>Landmarken</translation>
    </message>
    <message>
        <source>A click or Enter shows one, and the next click with Landmark moves it. F2 renames it.</source>
        <translation>Ein Klick zeigt eine, der nächste mit Landmarke verschiebt sie. F2 benennt um.</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>Entfernen</translation>
    </message>
    <message>
        <source>Removes the landmark that is chosen in the list, also with Del</source>
        <translation>Entfernt die in der Liste gewählte Landmarke, auch mit Entf</translation>
    </message>
    <message>
        <source>Choose a landmark in the list first.</source>
        <translation>Wählen Sie zuerst eine Landmarke in der Liste.</translation>
    </message>
    <message>
        <source>%1, %2, %3 mm</source>
        <translation>Bei %1, %2, %3 mm</translation>
    </message>
</context>
<context>
    <name>ImagingPage</name>
    <message>
        <source>table or headrest</source>
        <translation>Tisch oder Kopfstütze</translation>
    </message>
    <message>
        <source>cast</source>
        <translation>Gipsverband</translation>
    </message>
    <message>
        <source>metal</source>
        <translation>Metall</translation>
    </message>
    <message>
        <source>contrast medium</source>
        <translation>Kontrastmittel</translation>
    </message>
    <message>
        <source>bone</source>
        <translation>Knochen</translation>
    </message>
    <message>
        <source>%1: %2, %3 cm³</source>
        <translation>%1: %2, %3 cm³</translation>
    </message>
    <message>
        <source>Series of the CT</source>
        <translation>Serien des CT</translation>
    </message>
    <message>
        <source>The bone is made.</source>
        <translation>Der Knochen ist fertig.</translation>
    </message>
    <message>
        <source>Cancelled. Nothing was written.</source>
        <translation>Abgebrochen. Nichts wurde gespeichert.</translation>
    </message>
    <message>
        <source>Open a fol&amp;der…</source>
        <translation>&amp;Ordner öffnen…</translation>
    </message>
    <message>
        <source>The folder of a CT, or a CD</source>
        <translation>Der Ordner eines CT oder eine CD</translation>
    </message>
    <message>
        <source>Open a f&amp;ile…</source>
        <translation>Datei ö&amp;ffnen…</translation>
    </message>
    <message>
        <source>A zip or ISO image, a NIfTI, NRRD or MetaImage file</source>
        <translation>Ein Zip- oder ISO-Abbild, eine Datei in NIfTI, NRRD oder MetaImage</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>Fortschritt</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>&amp;Back</source>
        <translation>&amp;Zurück</translation>
    </message>
    <message>
        <source>To the start page. The scan and your edits stay here.</source>
        <translation>Zur Startseite. Das CT und Ihre Bearbeitung bleiben hier.</translation>
    </message>
    <message>
        <source>Window of the grey values</source>
        <translation>Fenster der Grauwerte</translation>
    </message>
    <message>
        <source>For bone</source>
        <translation>Für Knochen</translation>
    </message>
    <message>
        <source>For soft tissue</source>
        <translation>Für Weichteile</translation>
    </message>
    <message>
        <source>All values</source>
        <translation>Alle Werte</translation>
    </message>
    <message>
        <source>Window</source>
        <translation>Fenster</translation>
    </message>
    <message>
        <source>Threshold of bone</source>
        <translation>Schwellwert von Knochen</translation>
    </message>
    <message>
        <source> HU</source>
        <translation> HU</translation>
    </message>
    <message>
        <source>Threshold</source>
        <translation>Schwellwert</translation>
    </message>
    <message>
        <source>Parts of bone. The ticked ones are kept:</source>
        <translation>Teile aus Knochen. Die angehakten bleiben:</translation>
    </message>
    <message>
        <source>Parts of bone</source>
        <translation>Teile aus Knochen</translation>
    </message>
    <message>
        <source>Find the parts</source>
        <translation>Teile suchen</translation>
    </message>
    <message>
        <source>Finds the parts that reach the threshold</source>
        <translation>Sucht die Teile, die den Schwellwert erreichen</translation>
    </message>
    <message>
        <source>&amp;Keep the bone at the crosshair</source>
        <translation>Knochen am Faden&amp;kreuz behalten</translation>
    </message>
    <message>
        <source>Puts a seed there, from which the bone grows. Two seeds in one part separate it.</source>
        <translation>Setzt einen Saatpunkt für den Knochen. Zwei in einem Teil trennen ihn.</translation>
    </message>
    <message>
        <source>&amp;Undo the edit</source>
        <translation>Bearbeitung &amp;rückgängig</translation>
    </message>
    <message>
        <source>Takes the last edit back</source>
        <translation>Nimmt die letzte Bearbeitung zurück</translation>
    </message>
    <message>
        <source>&amp;Redo the edit</source>
        <translation>Bearbeitung &amp;wiederholen</translation>
    </message>
    <message>
        <source>Does it again</source>
        <translation>Führt sie noch einmal aus</translation>
    </message>
    <message>
        <source>&amp;Make the bone</source>
        <translation>K&amp;nochen erzeugen</translation>
    </message>
    <message>
        <source>Makes a case of the kept bones, and opens it to practise</source>
        <translation>Macht aus den behaltenen Knochen einen Fall und öffnet ihn zum Üben</translation>
    </message>
    <message>
        <source>The folder of a CT</source>
        <translation>Ordner eines CT</translation>
    </message>
    <message>
        <source>The file of a CT</source>
        <translation>Datei eines CT</translation>
    </message>
    <message>
        <source>Searching %1</source>
        <translation>%1 wird durchsucht</translation>
    </message>
    <message>
        <source>Choose a series.</source>
        <translation>Wählen Sie eine Serie.</translation>
    </message>
    <message>
        <source>Reading the series</source>
        <translation>Die Serie wird gelesen</translation>
    </message>
    <message>
        <source>Reading the series. You see its middle slice; the tools wait for the others.</source>
        <translation>Die Serie wird gelesen. Sie sehen die mittlere Schicht, die Werkzeuge warten noch.</translation>
    </message>
    <message>
        <source>Finding the parts of bone</source>
        <translation>Die Teile aus Knochen werden gesucht</translation>
    </message>
    <message>
        <source>Tick a bone in the list, or double-click it with Crosshair, and make it.</source>
        <translation>Knochen anhaken, oder mit dem Fadenkreuz doppelklicken, dann erzeugen.</translation>
    </message>
    <message>
        <source>%1 HU at %2, %3, %4 mm</source>
        <translation>%1 HU bei %2, %3, %4 mm</translation>
    </message>
    <message>
        <source>There is no bone at the crosshair. Move it into a tinted part.</source>
        <translation>Am Fadenkreuz ist kein Knochen. Bewegen Sie es in einen gefärbten Teil.</translation>
    </message>
    <message>
        <source>Part %1 is kept.</source>
        <translation>Teil %1 bleibt.</translation>
    </message>
    <message>
        <source>osteon-import is at work. Wait for it, or cancel it.</source>
        <translation>osteon-import arbeitet. Warten Sie darauf oder brechen Sie es ab.</translation>
    </message>
    <message>
        <source>Find the parts. If there are none, choose another threshold or box.</source>
        <translation>Suchen Sie die Teile. Gibt es keine, ändern Sie Schwellwert oder Quader.</translation>
    </message>
    <message>
        <source>There is nothing to undo.</source>
        <translation>Es gibt nichts rückgängig zu machen.</translation>
    </message>
    <message>
        <source>There is nothing to redo.</source>
        <translation>Es gibt nichts zu wiederholen.</translation>
    </message>
    <message>
        <source>Keep a bone first: tick it in the list, or double-click it with Crosshair.</source>
        <translation>Behalten Sie erst einen Knochen: Häkchen in der Liste oder Doppelklick.</translation>
    </message>
    <message>
        <source>The bone is being made</source>
        <translation>Der Knochen wird erzeugt</translation>
    </message>
    <message>
        <source>Open the folder of a CT, a CD, or a file: zip, ISO, NIfTI, NRRD or MetaImage.</source>
        <translation>Öffnen Sie einen Ordner, eine CD oder eine Datei: Zip, ISO, NIfTI, NRRD, MetaImage.</translation>
    </message>
    <message>
        <source>Filter of the scan</source>
        <translation>Filter der Aufnahme</translation>
    </message>
    <message>
        <source>A median takes out single wrong voxels, a Gaussian takes out noise</source>
        <translation>Ein Median entfernt einzelne falsche Voxel, ein Gaußfilter Rauschen</translation>
    </message>
    <message>
        <source>None</source>
        <translation>Keine</translation>
    </message>
    <message>
        <source>Median, slice</source>
        <translation>Median, Schicht</translation>
    </message>
    <message>
        <source>Median, volume</source>
        <translation>Median, Volumen</translation>
    </message>
    <message>
        <source>Gaussian</source>
        <translation>Gauß</translation>
    </message>
    <message>
        <source>Sigma of the Gaussian</source>
        <translation>Sigma des Gaußfilters</translation>
    </message>
    <message>
        <source>Sigma of the Gaussian. Half a voxel to one voxel is usual.</source>
        <translation>Sigma des Gaußfilters. Üblich ist ein halbes bis ein ganzes Voxel.</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>Filtering the scan</source>
        <translation>Die Aufnahme wird gefiltert</translation>
    </message>
    <message>
        <source>Choose the Gaussian first.</source>
        <translation>Wählen Sie zuerst den Gaußfilter.</translation>
    </message>
    <message>
        <source>The edit list is full, at 1000 edits or 1 MiB. Make the bone, or undo edits.</source>
        <translation>Die Liste der Änderungen ist voll (1000 oder 1 MiB). Nehmen Sie einige zurück.</translation>
    </message>
    <message>
        <source>What touches a bone there is separated from it and left out.</source>
        <translation>Was dort einen Knochen berührt, wird getrennt und weggelassen.</translation>
    </message>
    <message>
        <source>Drag a line through the bone. What is to its right is cut off.</source>
        <translation>Ziehen Sie eine Linie durch den Knochen. Was rechts liegt, fällt weg.</translation>
    </message>
    <message>
        <source>The line begins on no kept bone. Begin on one, or choose the bone.</source>
        <translation>Die Linie beginnt auf keinem Knochen. Wählen Sie einen.</translation>
    </message>
    <message>
        <source>The brush touched nothing in the box. A click with the tool Box takes it away.</source>
        <translation>Der Pinsel hat nichts im Quader berührt. Mit „Quader“ nimmt ein Klick ihn weg.</translation>
    </message>
    <message>
        <source>Several bones grow in this part. Choose the bone first.</source>
        <translation>In diesem Teil wachsen mehrere Knochen. Wählen Sie erst einen.</translation>
    </message>
    <message>
        <source>Seeds of two bones are in one voxel now. Choose a lower threshold, or undo one.</source>
        <translation>Zwei Knochen haben nun einen Saatpunkt. Senken Sie den Schwellwert.</translation>
    </message>
    <message>
        <source>No bone can be called that. Write up to 60 bytes that no other bone has.</source>
        <translation>So kann kein Knochen heißen. Der Name hat bis 60 Byte und gehört keinem anderen.</translation>
    </message>
    <message>
        <source>Smoothing</source>
        <translation>Glättung</translation>
    </message>
    <message>
        <source>No landmark can be called that. Write up to 60 bytes that no other landmark has.</source>
        <translation>So kann keine Landmarke heißen. Der Name hat bis 60 Byte und gehört keiner anderen.</translation>
    </message>
    <message>
        <source>Name the landmark first: up to 60 bytes, in the field Landmark.</source>
        <translation>Benennen Sie zuerst die Landmarke: bis 60 Byte, im Feld Landmarke.</translation>
    </message>
    <message>
        <source>%1 is at %2, %3, %4 mm.</source>
        <translation>%1 liegt bei %2, %3, %4 mm.</translation>
    </message>
    <message>
        <source>A page with pictures and numbers of the bone, beside the case; it opens at the end</source>
        <translation>Seite mit Bildern und Zahlen des Knochens, neben dem Fall; sie öffnet sich</translation>
    </message>
    <message>
        <source>The bone is made. Its report is in %1.</source>
        <translation>Der Knochen ist erzeugt. Sein Bericht ist %1.</translation>
    </message>
    <message>
        <source>The bone is made. No program opens its report %1.</source>
        <translation>Der Knochen ist erzeugt. Kein Programm öffnet seinen Bericht %1.</translation>
    </message>
    <message>
        <source>Ed&amp;ges</source>
        <translation>Kan&amp;ten</translation>
    </message>
    <message>
        <source>Lines where the HU change most, by Canny's method</source>
        <translation>Linien, wo sich die HU am meisten ändern, mit Cannys Verfahren</translation>
    </message>
    <message>
        <source>Finding the edges</source>
        <translation>Die Kanten werden gesucht</translation>
    </message>
    <message>
        <source>The edges of the scan are shown.</source>
        <translation>Die Kanten des Scans sind zu sehen.</translation>
    </message>
    <message>
        <source>With a rep&amp;ort</source>
        <translation>Mit Beri&amp;cht</translation>
    </message>
    <message>
        <source>Send to a server…</source>
        <translation>An einen Server senden…</translation>
    </message>
    <message>
        <source>Makes a case of the kept bones, and opens the dialog that sends it</source>
        <translation>Macht aus den behaltenen Knochen einen Fall und öffnet den Dialog, der ihn sendet</translation>
    </message>
    <message>
        <source>This bone is painted, so no part of the list is its own.</source>
        <translation>Dieser Knochen ist gemalt, darum gehört ihm kein Teil der Liste.</translation>
    </message>
    <message>
        <source>Part %1 is chosen in the list.</source>
        <translation>Teil %1 ist in der Liste gewählt.</translation>
    </message>
    <message>
        <source>Sub-volumes…</source>
        <translation>Teilvolumen…</translation>
    </message>
    <message>
        <source>Shows bounding box, section boxes and quadtree of what is kept, and writes them</source>
        <translation>Zeigt Hüllquader, Abschnittsquader und Quadtree des Behaltenen und schreibt sie</translation>
    </message>
    <message>
        <source>Writing the root sub-volumes</source>
        <translation>Die Wurzel-Teilvolumen werden geschrieben</translation>
    </message>
    <message>
        <source>The root sub-volumes are in %1.</source>
        <translation>Die Wurzel-Teilvolumen sind in %1.</translation>
    </message>
    <message>
        <source>The last edit is taken back.</source>
        <translation>Die letzte Bearbeitung ist zurückgenommen.</translation>
    </message>
    <message>
        <source>The edit is done again.</source>
        <translation>Die Bearbeitung ist wiederhergestellt.</translation>
    </message>
    <message>
        <source>The case of the bone is removed again. The edits are still here.</source>
        <translation>Der Fall des Knochens ist wieder gelöscht. Ihre Bearbeitungen sind noch da.</translation>
    </message>
    <message>
        <source>Import a CT</source>
        <translation>CT importieren</translation>
    </message>
    <message>
        <source>Is the CT a folder or a file?</source>
        <translation>Ist das CT ein Ordner oder eine Datei?</translation>
    </message>
    <message>
        <source>A file is a zip or ISO image, NIfTI, NRRD or MetaImage.</source>
        <translation>Eine Datei ist ein Zip- oder ISO-Abbild, NIfTI, NRRD oder MetaImage.</translation>
    </message>
</context>
<context>
    <name>ImagingPlane</name>
    <message>
        <source>Waits for the other slices</source>
        <translation>Wartet auf die anderen Schichten</translation>
    </message>
    <message>
        <source>Coronal plane</source>
        <translation>Koronale Ebene</translation>
    </message>
    <message>
        <source>Sagittal plane</source>
        <translation>Sagittale Ebene</translation>
    </message>
    <message>
        <source>Axial plane</source>
        <translation>Axiale Ebene</translation>
    </message>
    <message>
        <source>%1: slice</source>
        <translation>%1: Schicht</translation>
    </message>
    <message>
        <source>%1, %2 of %3</source>
        <translation>%1, %2 von %3</translation>
    </message>
    <message>
        <source>Left: the tool. Enter, or double click with Crosshair: keep. Right drag: window. Wheel: slices.</source>
        <translation>Links: Werkzeug. Fadenkreuz doppelt, Eingabe: behalten. Rechts: Fenster. Rad: Schicht</translation>
    </message>
</context>
<context>
    <name>ImagingSolid</name>
    <message>
        <source>Soft tissue</source>
        <translation>Weichteile</translation>
    </message>
    <message>
        <source>Shows skin and muscle of the scan round the bone</source>
        <translation>Zeigt Haut und Muskeln des Scans um den Knochen</translation>
    </message>
    <message>
        <source>This surface is too large. Take a higher threshold, or smooth the scan.</source>
        <translation>Diese Oberfläche ist zu groß. Erhöhen Sie den Schwellwert, oder glätten Sie.</translation>
    </message>
    <message>
        <source>The parts that were found last</source>
        <translation>Die zuletzt gefundenen Teile</translation>
    </message>
    <message>
        <source>Being made …</source>
        <translation>Entsteht …</translation>
    </message>
    <message>
        <source>What you keep appears here in three dimensions.</source>
        <translation>Was Sie behalten, erscheint hier in drei Dimensionen.</translation>
    </message>
</context>
<context>
    <name>ImagingSteps</name>
    <message>
        <source>The edges are not those of the scan. Find them again.</source>
        <translation>Die Kanten gehören nicht zum Scan. Suchen Sie sie noch einmal.</translation>
    </message>
    <message>
        <source>, pitch %1 × %2 × %3 mm</source>
        <translation>, Abstand %1 × %2 × %3 mm</translation>
    </message>
    <message>
        <source>Series %1</source>
        <translation>Serie %1</translation>
    </message>
    <message>
        <source>Cannot make the folder %1. Choose a place where you may write.</source>
        <translation>Der Ordner %1 kann nicht angelegt werden. Wählen Sie einen beschreibbaren Ort.</translation>
    </message>
    <message>
        <source>%1 has no CT series. Open another folder or file.</source>
        <translation>%1 hat keine CT-Serie. Öffnen Sie einen anderen Ordner oder eine andere Datei.</translation>
    </message>
    <message>
        <source>Cannot write %1. Is the disk full?</source>
        <translation>%1 kann nicht geschrieben werden. Ist die Platte voll?</translation>
    </message>
    <message>
        <source>CT, 1 slice, %1 × %2 pixels</source>
        <translation>CT, 1 Schicht, %1 × %2 Pixel</translation>
    </message>
    <message>
        <source>CT, %3 slices, %1 × %2 pixels</source>
        <translation>CT, %3 Schichten, %1 × %2 Pixel</translation>
    </message>
</context>
<context>
    <name>ImagingTools</name>
    <message>
        <source>Crosshair</source>
        <translation>Fadenkreuz</translation>
    </message>
    <message>
        <source>The left button moves the crosshair</source>
        <translation>Die linke Taste bewegt das Fadenkreuz</translation>
    </message>
    <message>
        <source>Paint</source>
        <translation>Malen</translation>
    </message>
    <message>
        <source>What the brush touches becomes bone</source>
        <translation>Was der Pinsel berührt, wird Knochen</translation>
    </message>
    <message>
        <source>Erase</source>
        <translation>Radieren</translation>
    </message>
    <message>
        <source>What the brush touches is no bone</source>
        <translation>Was der Pinsel berührt, ist kein Knochen</translation>
    </message>
    <message>
        <source>Cut</source>
        <translation>Schneiden</translation>
    </message>
    <message>
        <source>Drag a line. What is to its right is cut off the bone where the line begins.</source>
        <translation>Ziehen Sie eine Linie. Was rechts von ihr liegt, wird abgeschnitten.</translation>
    </message>
    <message>
        <source>Outside</source>
        <translation>Außen</translation>
    </message>
    <message>
        <source>Click on what is no bone and touches one. It is separated and left out.</source>
        <translation>Klicken Sie auf etwas am Knochen, das keiner ist. Es wird weggelassen.</translation>
    </message>
    <message>
        <source>Box</source>
        <translation>Quader</translation>
    </message>
    <message>
        <source>Drag a rectangle on two planes. Only the box counts. A click takes it away.</source>
        <translation>Ziehen Sie Rechtecke auf zwei Ebenen. Nur der Quader zählt. Ein Klick entfernt ihn.</translation>
    </message>
    <message>
        <source>Radius of the brush</source>
        <translation>Radius des Pinsels</translation>
    </message>
    <message>
        <source>Radius of the brush, also Ctrl and the wheel</source>
        <translation>Radius des Pinsels, auch mit Strg und Rad</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>One slice</source>
        <translation>Eine Schicht</translation>
    </message>
    <message>
        <source>The brush is a disc in the slice that you see, instead of a ball</source>
        <translation>Der Pinsel ist eine Scheibe in der sichtbaren Schicht statt einer Kugel</translation>
    </message>
    <message>
        <source>Choose the brush first: Paint or Erase.</source>
        <translation>Wählen Sie zuerst den Pinsel: Malen oder Radieren.</translation>
    </message>
    <message>
        <source>Landmark</source>
        <translation>Landmarke</translation>
    </message>
    <message>
        <source>Click where the landmark of the field Landmark is. The case keeps it.</source>
        <translation>Klicken Sie, wo die Landmarke des Feldes liegt. Der Fall behält sie.</translation>
    </message>
</context>
<context>
    <name>ImporterRun</name>
    <message>
        <source>Cannot make the folder %1. Choose a place where you may write.</source>
        <translation>Der Ordner %1 kann nicht angelegt werden. Wählen Sie einen beschreibbaren Ort.</translation>
    </message>
    <message>
        <source>osteon-import is not installed. Install the package osteon-import.</source>
        <translation>osteon-import ist nicht installiert. Installieren Sie das Paket osteon-import.</translation>
    </message>
    <message>
        <source>osteon-import ended without a result.</source>
        <translation>osteon-import endete ohne Ergebnis.</translation>
    </message>
    <message>
        <source>osteon-import was ended by force or crashed. Try again.</source>
        <translation>osteon-import wurde abgebrochen oder ist abgestürzt. Versuchen Sie es noch einmal.</translation>
    </message>
</context>
<context>
    <name>Language</name>
    <message>
        <source>&amp;System</source>
        <translation>&amp;System</translation>
    </message>
    <message>
        <source>The choice takes effect at the next start.</source>
        <translation>Die Wahl gilt ab dem nächsten Start.</translation>
    </message>
</context>
<context>
    <name>Library</name>
    <message>
        <source>Human skull, from CT</source>
        <translation>Schädel eines Menschen, aus dem CT</translation>
    </message>
    <message>
        <source>Femur, a phantom</source>
        <translation>Femur, Phantom</translation>
    </message>
    <message>
        <source>Tibia, a phantom</source>
        <translation>Tibia, Phantom</translation>
    </message>
    <message>
        <source>Patella, a phantom</source>
        <translation>Patella, Phantom</translation>
    </message>
    <message>
        <source>Knee, a phantom</source>
        <translation>Knie, Phantom</translation>
    </message>
    <message>
        <source>Hip, a phantom</source>
        <translation>Hüfte, Phantom</translation>
    </message>
    <message>
        <source>Pelvis, a phantom</source>
        <translation>Becken, Phantom</translation>
    </message>
</context>
<context>
    <name>MainWindow</name>
    <message>
        <source>The bone</source>
        <translation>Der Knochen</translation>
    </message>
    <message>
        <source>Before %1</source>
        <translation>Vor: %1</translation>
    </message>
    <message>
        <source>Tool</source>
        <translation>Werkzeug</translation>
    </message>
    <message>
        <source>Gauges</source>
        <translation>Messwerte</translation>
    </message>
    <message>
        <source>&amp;File</source>
        <translation>&amp;Datei</translation>
    </message>
    <message>
        <source>&amp;Start page</source>
        <translation>&amp;Startseite</translation>
    </message>
    <message>
        <source>&amp;Open a case…</source>
        <translation>Fall öff&amp;nen…</translation>
    </message>
    <message>
        <source>&amp;Import a CT…</source>
        <translation>CT &amp;importieren…</translation>
    </message>
    <message>
        <source>&amp;Join a room…</source>
        <translation>Einem &amp;Raum beitreten…</translation>
    </message>
    <message>
        <source>Save a &amp;picture…</source>
        <translation>Bild s&amp;peichern…</translation>
    </message>
    <message>
        <source>&amp;Quit</source>
        <translation>&amp;Beenden</translation>
    </message>
    <message>
        <source>&amp;Edit</source>
        <translation>&amp;Bearbeiten</translation>
    </message>
    <message>
        <source>&amp;Undo</source>
        <translation>&amp;Rückgängig</translation>
    </message>
    <message>
        <source>&amp;Redo</source>
        <translation>&amp;Wiederholen</translation>
    </message>
    <message>
        <source>Done again.</source>
        <translation>Wiederholt.</translation>
    </message>
    <message>
        <source>&amp;Mark this moment…</source>
        <translation>Zeitpunkt &amp;markieren…</translation>
    </message>
    <message>
        <source>&amp;View</source>
        <translation>&amp;Ansicht</translation>
    </message>
    <message>
        <source>&amp;Whole bone</source>
        <translation>Ganzer &amp;Knochen</translation>
    </message>
    <message>
        <source>At the &amp;tool</source>
        <translation>Am &amp;Werkzeug</translation>
    </message>
    <message>
        <source>From the &amp;front</source>
        <translation>Von &amp;vorn</translation>
    </message>
    <message>
        <source>From the &amp;back</source>
        <translation>Von &amp;hinten</translation>
    </message>
    <message>
        <source>From the patient&apos;s &amp;left</source>
        <translation>Von &amp;links (Patient)</translation>
    </message>
    <message>
        <source>From the patient&apos;s &amp;right</source>
        <translation>Von &amp;rechts (Patient)</translation>
    </message>
    <message>
        <source>From &amp;above</source>
        <translation>Von &amp;oben</translation>
    </message>
    <message>
        <source>From b&amp;elow</source>
        <translation>Von &amp;unten</translation>
    </message>
    <message>
        <source>F&amp;ull screen</source>
        <translation>Voll&amp;bild</translation>
    </message>
    <message>
        <source>La&amp;nguage</source>
        <translation>&amp;Sprache</translation>
    </message>
    <message>
        <source>&amp;Tools</source>
        <translation>&amp;Werkzeuge</translation>
    </message>
    <message>
        <source>&amp;Put the tool down</source>
        <translation>Werkzeug &amp;ablegen</translation>
    </message>
    <message>
        <source>Run the &amp;spindle</source>
        <translation>A&amp;ntrieb ein</translation>
    </message>
    <message>
        <source>S&amp;ound</source>
        <translation>&amp;Ton</translation>
    </message>
    <message>
        <source>&amp;Help</source>
        <translation>&amp;Hilfe</translation>
    </message>
    <message>
        <source>&amp;How to hold a tool</source>
        <translation>So &amp;halten Sie ein Werkzeug</translation>
    </message>
    <message>
        <source>&amp;About Osteon</source>
        <translation>Ü&amp;ber Osteon</translation>
    </message>
    <message>
        <source>About Osteon</source>
        <translation>Über Osteon</translation>
    </message>
    <message>
        <source>Osteon %1 simulates bone surgery. It is for research and teaching. It is not a medical device.</source>
        <translation>Osteon %1 simuliert Knochenchirurgie für Forschung und Lehre. Kein Medizinprodukt.</translation>
    </message>
    <message>
        <source>Actions</source>
        <translation>Aktionen</translation>
    </message>
    <message>
        <source>Cancelled. Nothing was written.</source>
        <translation>Abgebrochen. Nichts wurde gespeichert.</translation>
    </message>
    <message>
        <source>%1 is made now. The next time it opens at once.</source>
        <translation>%1 wird jetzt erzeugt. Beim nächsten Mal öffnet sich der Fall sofort.</translation>
    </message>
    <message>
        <source>Importing %1</source>
        <translation>%1 wird importiert</translation>
    </message>
    <message>
        <source>Join a room</source>
        <translation>Einem Raum beitreten</translation>
    </message>
    <message>
        <source>Room (empty: the only one)</source>
        <translation>Raum (leer: der einzige)</translation>
    </message>
    <message>
        <source>Your name</source>
        <translation>Ihr Name</translation>
    </message>
    <message>
        <source>%1 – Osteon</source>
        <translation>%1 – Osteon</translation>
    </message>
    <message>
        <source>The room opens…</source>
        <translation>Der Raum öffnet sich…</translation>
    </message>
    <message>
        <source>Choose a tool on the left, then hold the left button on the bone.</source>
        <translation>Wählen Sie links ein Werkzeug, dann halten Sie die linke Taste auf dem Knochen.</translation>
    </message>
    <message>
        <source>Click on the bone to place it there.</source>
        <translation>Klicken Sie auf die Stelle des Knochens.</translation>
    </message>
    <message>
        <source>Placed.</source>
        <translation>Platziert.</translation>
    </message>
    <message>
        <source>Undone.</source>
        <translation>Rückgängig gemacht.</translation>
    </message>
    <message>
        <source>Mark this moment</source>
        <translation>Zeitpunkt markieren</translation>
    </message>
    <message>
        <source>Its name</source>
        <translation>Bezeichnung</translation>
    </message>
    <message>
        <source>Marked.</source>
        <translation>Markiert.</translation>
    </message>
    <message>
        <source>Save the picture</source>
        <translation>Bild speichern</translation>
    </message>
    <message>
        <source>Pictures (*.png)</source>
        <translation>Bilder (*.png)</translation>
    </message>
    <message>
        <source>Saved %1.</source>
        <translation>%1 ist gespeichert.</translation>
    </message>
    <message>
        <source>How to hold a tool</source>
        <translation>So halten Sie ein Werkzeug</translation>
    </message>
    <message>
        <source>Connection lost, trying again</source>
        <translation>Verbindung verloren, neuer Versuch läuft</translation>
    </message>
    <message>
        <source>Connected to %1</source>
        <translation>Verbunden mit %1</translation>
    </message>
    <message>
        <source>Tip %1, %2, %3 mm</source>
        <translation>Spitze %1; %2; %3 mm</translation>
    </message>
    <message>
        <source>Pointer</source>
        <translation>Zeiger</translation>
    </message>
    <message>
        <source>The pointer&apos;s device is away</source>
        <translation>Das Zeigergerät fehlt</translation>
    </message>
    <message>
        <source>Clipping</source>
        <translation>Schnittansicht</translation>
    </message>
    <message>
        <source>Save &amp;bone as…</source>
        <translation>&amp;Knochen speichern unter…</translation>
    </message>
    <message>
        <source>Open a case</source>
        <translation>Fall öffnen</translation>
    </message>
    <message>
        <source>Cases (*.osteon case.json);;All files (*)</source>
        <translation>Fälle (*.osteon case.json);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>Opening %1</source>
        <translation>%1 wird geöffnet</translation>
    </message>
    <message>
        <source>Save the bone</source>
        <translation>Knochen speichern</translation>
    </message>
    <message>
        <source>Cases (*.osteon)</source>
        <translation>Fälle (*.osteon)</translation>
    </message>
    <message>
        <source>Another bone is being saved. Try again when that is done.</source>
        <translation>Ein anderer Knochen wird gerade gespeichert. Versuchen Sie es danach noch einmal.</translation>
    </message>
    <message>
        <source>Another case is being sent. Try again when that is done.</source>
        <translation>Ein anderer Fall wird gerade gesendet. Versuchen Sie es danach noch einmal.</translation>
    </message>
    <message>
        <source>Saving %1: %2 %</source>
        <translation>%1 wird gespeichert: %2 %</translation>
    </message>
    <message>
        <source>%1 is no case: drop an .osteon file, or the folder of a case.</source>
        <translation>%1 ist kein Fall: Ziehen Sie eine .osteon-Datei oder den Ordner eines Falls hierher.</translation>
    </message>
    <message>
        <source>You watch. The view follows the tool; a drag turns the bone, T follows again.</source>
        <translation>Sie schauen zu. Die Ansicht folgt dem Werkzeug; Ziehen löst sie, T folgt wieder.</translation>
    </message>
    <message>
        <source>Panels</source>
        <translation>Bereiche</translation>
    </message>
    <message>
        <source>The left button pushes on the bone, the right one turns the tool. The wheel sets the push.</source>
        <translation>Linke Taste drückt, rechte dreht das Werkzeug. Das Rad stellt den Andruck ein.</translation>
    </message>
    <message>
        <source>Left bar</source>
        <translation>Linke Leiste</translation>
    </message>
    <message>
        <source>the tools; a long click shows the others of a group</source>
        <translation>die Werkzeuge; ein langer Klick zeigt die anderen der Gruppe</translation>
    </message>
    <message>
        <source>Mouse over the bone</source>
        <translation>Maus über dem Knochen</translation>
    </message>
    <message>
        <source>the tool rests where the pointer is</source>
        <translation>Das Werkzeug liegt dort auf, wo der Zeiger ist</translation>
    </message>
    <message>
        <source>Left button, held</source>
        <translation>Linke Taste halten</translation>
    </message>
    <message>
        <source>the hand pushes</source>
        <translation>Die Hand drückt</translation>
    </message>
    <message>
        <source>Pen</source>
        <translation>Stift</translation>
    </message>
    <message>
        <source>its tip pushes, as hard as you press it</source>
        <translation>seine Spitze drückt, so stark wie Sie sie aufdrücken</translation>
    </message>
    <message>
        <source>Wheel</source>
        <translation>Rad</translation>
    </message>
    <message>
        <source>how hard the hand pushes</source>
        <translation>wie stark die Hand drückt</translation>
    </message>
    <message>
        <source>Right button, dragged</source>
        <translation>Mit der rechten Taste ziehen</translation>
    </message>
    <message>
        <source>turns the tool; with Ctrl about its own axis</source>
        <translation>dreht das Werkzeug, mit Strg um seine eigene Achse</translation>
    </message>
    <message>
        <source>Shift</source>
        <translation>Umschalt</translation>
    </message>
    <message>
        <source>motion ten times smaller</source>
        <translation>zehnmal kleinere Bewegungen</translation>
    </message>
    <message>
        <source>Space</source>
        <translation>Leertaste</translation>
    </message>
    <message>
        <source>spindle on or off</source>
        <translation>Antrieb ein oder aus</translation>
    </message>
    <message>
        <source>Escape</source>
        <translation>Esc</translation>
    </message>
    <message>
        <source>puts the tool down</source>
        <translation>legt das Werkzeug ab</translation>
    </message>
    <message>
        <source>Middle button</source>
        <translation>Mittlere Taste</translation>
    </message>
    <message>
        <source>turns the bone; with Shift it moves it</source>
        <translation>dreht den Knochen, mit Umschalt verschiebt sie ihn</translation>
    </message>
    <message>
        <source>Ctrl and wheel</source>
        <translation>Strg und Rad</translation>
    </message>
    <message>
        <source>nearer or farther</source>
        <translation>näher oder ferner</translation>
    </message>
    <message>
        <source>Beside the bone, or without a tool</source>
        <translation>Neben dem Knochen oder ohne Werkzeug</translation>
    </message>
    <message>
        <source>the left button and the wheel move the view</source>
        <translation>Linke Taste und Rad bewegen die Ansicht</translation>
    </message>
    <message>
        <source>&amp;Volume and waveform…</source>
        <translation>&amp;Lautstärke und Wellenform…</translation>
    </message>
    <message>
        <source>Connections</source>
        <translation>Verbindungen</translation>
    </message>
    <message>
        <source>&amp;Tour</source>
        <translation>&amp;Rundgang</translation>
    </message>
    <message>
        <source>Warn near structures at risk…</source>
        <translation>Bei gefährdeten Strukturen warnen…</translation>
    </message>
    <message>
        <source>Structures at risk</source>
        <translation>Gefährdete Strukturen</translation>
    </message>
    <message>
        <source>Warn when the tip is nearer than (mm):</source>
        <translation>Warnen, wenn die Spitze näher ist als (mm):</translation>
    </message>
    <message>
        <source>I and U</source>
        <translation>I und U</translation>
    </message>
    <message>
        <source>irrigation and suction of the other hand, on or off</source>
        <translation>Spülung und Absaugung der anderen Hand, an oder aus</translation>
    </message>
    <message>
        <source>Irrigation</source>
        <translation>Spülung</translation>
    </message>
    <message>
        <source>Suction</source>
        <translation>Absaugung</translation>
    </message>
    <message>
        <source>&amp;Irrigation</source>
        <translation>&amp;Spülung</translation>
    </message>
    <message>
        <source>S&amp;uction</source>
        <translation>A&amp;bsaugung</translation>
    </message>
    <message>
        <source>Joining the room at %1</source>
        <translation>Beitritt zum Raum bei %1</translation>
    </message>
    <message>
        <source>The window closes when the bone is saved. Close it once more to give that up.</source>
        <translation>Das Fenster schließt nach dem Speichern. Noch einmal schließen bricht es ab.</translation>
    </message>
    <message>
        <source>The window closes when the case is sent. Close it once more to give that up.</source>
        <translation>Das Fenster schließt nach dem Senden. Noch einmal schließen bricht es ab.</translation>
    </message>
    <message>
        <source>Game pad</source>
        <translation>Gamepad</translation>
    </message>
    <message>
        <source>Sticks of a game pad</source>
        <translation>Sticks eines Gamepads</translation>
    </message>
    <message>
        <source>the left one moves the tool, the right one turns it</source>
        <translation>der linke bewegt das Werkzeug, der rechte dreht es</translation>
    </message>
    <message>
        <source>Triggers of a game pad</source>
        <translation>Trigger eines Gamepads</translation>
    </message>
    <message>
        <source>the right one pushes, the left one runs the spindle</source>
        <translation>der rechte drückt, der linke lässt die Spindel laufen</translation>
    </message>
    <message>
        <source>Buttons of a game pad</source>
        <translation>Tasten eines Gamepads</translation>
    </message>
    <message>
        <source>A: spindle, B: undo; shoulder buttons: motion ten times smaller</source>
        <translation>A: Spindel, B: rückgängig; Schultertasten: zehnmal kleinere Bewegungen</translation>
    </message>
    <message>
        <source>The window was busy for a second, so the hand stopped pushing. Press again.</source>
        <translation>Das Fenster war eine Sekunde beschäftigt. Die Hand drückt nicht mehr. Neu drücken.</translation>
    </message>
    <message>
        <source>Checking %1</source>
        <translation>%1 wird geprüft</translation>
    </message>
    <message>
        <source>%1 was damaged and is made anew.</source>
        <translation>%1 war beschädigt und wird neu erzeugt.</translation>
    </message>
    <message>
        <source>The unpacked copy of %1 was damaged and is removed. Open the file again.</source>
        <translation>Die entpackte Kopie von %1 war beschädigt und wurde entfernt. Die Datei neu öffnen.</translation>
    </message>
    <message>
        <source>Force on the hand</source>
        <translation>Kraft auf die Hand</translation>
    </message>
    <message>
        <source>The next practice room shows force in this way.</source>
        <translation>Der nächste Übungsraum zeigt die Kraft so.</translation>
    </message>
    <message>
        <source>The haptic client starts again to show force in this way.</source>
        <translation>Das Haptikprogramm startet neu, um die Kraft so zu zeigen.</translation>
    </message>
    <message>
        <source>Open a bone or join a room first.</source>
        <translation>Öffnen Sie erst einen Knochen, oder betreten Sie einen Raum.</translation>
    </message>
    <message>
        <source>You only watch this room.</source>
        <translation>Sie sehen in diesem Raum nur zu.</translation>
    </message>
    <message>
        <source>A case is made or checked. Wait for it, or cancel it.</source>
        <translation>Ein Fall wird erstellt oder geprüft. Warten Sie, oder brechen Sie ab.</translation>
    </message>
    <message>
        <source>The room opens. Wait for it.</source>
        <translation>Der Raum wird geöffnet. Warten Sie, bis er offen ist.</translation>
    </message>
    <message>
        <source>Choose a tool on the left first.</source>
        <translation>Wählen Sie erst links ein Werkzeug.</translation>
    </message>
    <message>
        <source>Irrigation and suction work only with a bone that you opened in this window.</source>
        <translation>Spülung und Absaugung wirken nur bei einem hier geöffneten Knochen.</translation>
    </message>
    <message>
        <source>Only a bone that you opened in this window can be saved here.</source>
        <translation>Nur ein hier geöffneter Knochen kann gespeichert werden.</translation>
    </message>
    <message>
        <source>Wear and force law work only with a bone that you opened in this window.</source>
        <translation>Verschleiß und Kraftgesetz wirken nur bei einem hier geöffneten Knochen.</translation>
    </message>
    <message>
        <source>A click places this tool. It has neither wear nor force law.</source>
        <translation>Ein Klick setzt dieses Werkzeug. Es hat weder Verschleiß noch Kraftgesetz.</translation>
    </message>
    <message>
        <source>Slices</source>
        <translation>Schnittbilder</translation>
    </message>
    <message>
        <source>C-arm</source>
        <translation>C-Bogen</translation>
    </message>
    <message>
        <source>&amp;Plan</source>
        <translation>&amp;Planung</translation>
    </message>
    <message>
        <source>The case to send</source>
        <translation>Der Fall zum Senden</translation>
    </message>
    <message>
        <source>S&amp;end a case to a server…</source>
        <translation>Fall an Server s&amp;enden…</translation>
    </message>
    <message>
        <source>Another case is being sent. The new one is in %1; send it after that.</source>
        <translation>Ein anderer Fall wird gerade gesendet. Der neue liegt in %1; senden Sie ihn danach.</translation>
    </message>
    <message>
        <source>Send the bone in the dialog.</source>
        <translation>Senden Sie den Knochen im Dialog.</translation>
    </message>
</context>
<context>
    <name>OthersShots</name>
    <message>
        <source>Shots of the others in the room</source>
        <translation>Aufnahmen der anderen im Raum</translation>
    </message>
    <message>
        <source>Of a person the newest picture is shown, of a line below it that press.</source>
        <translation>Von einer Person erscheint das neueste Bild, von einer Zeile darunter dieser Druck.</translation>
    </message>
    <message>
        <source>The picture is made again from the bone and the tools as they are when you choose it.</source>
        <translation>Das Bild wird aus Knochen und Werkzeugen neu berechnet, wie sie bei der Auswahl sind.</translation>
    </message>
    <message>
        <source>Pictures of</source>
        <translation>Bilder von</translation>
    </message>
    <message>
        <source>Shots</source>
        <translation>Aufnahmen</translation>
    </message>
    <message>
        <source>Exposure, seconds</source>
        <translation>Strahlzeit in Sekunden</translation>
    </message>
    <message>
        <source>Dose-area product, nominal</source>
        <translation>Dosisflächenprodukt, nominal</translation>
    </message>
    <message>
        <source>Mine</source>
        <translation>Mir</translation>
    </message>
    <message>
        <source>Shot %1, %2</source>
        <translation>Aufnahme %1, %2</translation>
    </message>
    <message>
        <source>Shots %1 to %2, %3</source>
        <translation>Aufnahmen %1 bis %2, %3</translation>
    </message>
    <message>
        <source>%1, shot %2</source>
        <translation>%1, Aufnahme %2</translation>
    </message>
</context>
<context>
    <name>PlanBar</name>
    <message>
        <source>Planned axes and planes</source>
        <translation>Geplante Achsen und Ebenen</translation>
    </message>
    <message>
        <source>The tool is compared with this one. Its first point is where the slices go.</source>
        <translation>Mit ihr wird das Instrument verglichen. Die Schnitte gehen durch ihren ersten Punkt.</translation>
    </message>
    <message>
        <source>Nothing is planned</source>
        <translation>Nichts ist geplant</translation>
    </message>
    <message>
        <source>Nothing is chosen</source>
        <translation>Nichts ist gewählt</translation>
    </message>
    <message>
        <source>Only an instructor plans in this room.</source>
        <translation>In diesem Raum planen nur Lehrende.</translation>
    </message>
    <message>
        <source>The last change of the plan is still on its way. Try again.</source>
        <translation>Die letzte Änderung der Planung ist noch unterwegs. Versuchen Sie es noch einmal.</translation>
    </message>
    <message>
        <source>You have changed nothing in the plan that could be undone.</source>
        <translation>Sie haben in der Planung nichts geändert, das rückgängig gemacht werden könnte.</translation>
    </message>
    <message>
        <source>The line is too short, or goes straight into the picture. Click elsewhere.</source>
        <translation>Die Linie ist zu kurz oder geht gerade in das Bild hinein. Klicken Sie woanders.</translation>
    </message>
    <message>
        <source>Draw an &amp;axis</source>
        <translation>&amp;Achse zeichnen</translation>
    </message>
    <message>
        <source>The entry, then the target, by two clicks on the slices or on the bone</source>
        <translation>Eintritt, dann Ziel, durch zwei Klicks auf die Schnitte oder den Knochen</translation>
    </message>
    <message>
        <source>Axis</source>
        <translation>Achse</translation>
    </message>
    <message>
        <source>Draw a &amp;plane</source>
        <translation>&amp;Ebene zeichnen</translation>
    </message>
    <message>
        <source>Both ends of its line. The plane goes straight into the picture</source>
        <translation>Beide Enden ihrer Linie. Die Ebene geht gerade in das Bild hinein</translation>
    </message>
    <message>
        <source>Plane</source>
        <translation>Ebene</translation>
    </message>
    <message>
        <source>Point at the &amp;cross of the slices</source>
        <translation>Punkt am &amp;Kreuz der Schnitte</translation>
    </message>
    <message>
        <source>The next point of what is being drawn, without the mouse</source>
        <translation>Der nächste Punkt dessen, was gezeichnet wird, ohne Maus</translation>
    </message>
    <message>
        <source>The name of the chosen axis or plane</source>
        <translation>Der Name der gewählten Achse oder Ebene</translation>
    </message>
    <message>
        <source>&amp;Delete</source>
        <translation>&amp;Löschen</translation>
    </message>
    <message>
        <source>Removes the chosen axis or plane</source>
        <translation>Entfernt die gewählte Achse oder Ebene</translation>
    </message>
    <message>
        <source>Deleted.</source>
        <translation>Gelöscht.</translation>
    </message>
    <message>
        <source>Delete</source>
        <translation>Löschen</translation>
    </message>
    <message>
        <source>&amp;Undo in the plan</source>
        <translation>In der Planung &amp;rückgängig</translation>
    </message>
    <message>
        <source>Takes back your last change of the plan</source>
        <translation>Nimmt Ihre letzte Änderung der Planung zurück</translation>
    </message>
    <message>
        <source>Undone in the plan.</source>
        <translation>In der Planung rückgängig gemacht.</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>&amp;Save the plan…</source>
        <translation>Planung &amp;speichern…</translation>
    </message>
    <message>
        <source>Click the entry, on the bone or on a slice.</source>
        <translation>Klicken Sie den Eintritt an, auf dem Knochen oder einem Schnitt.</translation>
    </message>
    <message>
        <source>Click one end of the plane&apos;s line, on the bone or on a slice.</source>
        <translation>Klicken Sie ein Ende der Linie der Ebene an, auf dem Knochen oder einem Schnitt.</translation>
    </message>
    <message>
        <source>Choose first whether to draw an axis or a plane.</source>
        <translation>Wählen Sie zuerst, ob Sie eine Achse oder eine Ebene zeichnen.</translation>
    </message>
    <message>
        <source>The second point is too near to the first one. Click farther away.</source>
        <translation>Der zweite Punkt ist dem ersten zu nahe. Klicken Sie weiter entfernt.</translation>
    </message>
    <message>
        <source>Click the target, where the tip is to stop.</source>
        <translation>Klicken Sie das Ziel an, wo die Spitze enden soll.</translation>
    </message>
    <message>
        <source>Click the other end of the plane&apos;s line.</source>
        <translation>Klicken Sie das andere Ende der Linie der Ebene an.</translation>
    </message>
    <message>
        <source>Drawn. Drag its ends on the slices to move them.</source>
        <translation>Gezeichnet. Ziehen Sie die Enden auf den Schnitten, um sie zu verschieben.</translation>
    </message>
    <message>
        <source>Moved.</source>
        <translation>Verschoben.</translation>
    </message>
    <message>
        <source>Draw an axis or a plane first, or choose one.</source>
        <translation>Zeichnen Sie zuerst eine Achse oder Ebene, oder wählen Sie eine.</translation>
    </message>
    <message>
        <source>Name in the plan</source>
        <translation>Name in der Planung</translation>
    </message>
    <message>
        <source>Its name</source>
        <translation>Bezeichnung</translation>
    </message>
    <message>
        <source>This name is too long. Give a shorter one.</source>
        <translation>Dieser Name ist zu lang. Wählen Sie einen kürzeren.</translation>
    </message>
    <message>
        <source>Renamed.</source>
        <translation>Umbenannt.</translation>
    </message>
    <message>
        <source>Axis %1</source>
        <translation>Achse %1</translation>
    </message>
    <message>
        <source>Plane %1</source>
        <translation>Ebene %1</translation>
    </message>
    <message>
        <source>Save the plan</source>
        <translation>Planung speichern</translation>
    </message>
    <message>
        <source>Plans (*.json)</source>
        <translation>Pläne (*.json)</translation>
    </message>
    <message>
        <source>Saved %1.</source>
        <translation>%1 ist gespeichert.</translation>
    </message>
    <message>
        <source>Re&amp;name…</source>
        <translation>&amp;Umbenennen…</translation>
    </message>
    <message>
        <source>Rename…</source>
        <translation>Umbenennen…</translation>
    </message>
    <message>
        <source>The axes and planes as a file; a simulated surgeon drills its axes</source>
        <translation>Die Achsen und Ebenen als Datei; ein simulierter Chirurg bohrt ihre Achsen</translation>
    </message>
    <message>
        <source>Draw an axis or a plane first.</source>
        <translation>Zeichnen Sie zuerst eine Achse oder Ebene.</translation>
    </message>
    <message>
        <source>Saved %1. It has no axis that a simulated surgeon could drill.</source>
        <translation>%1 ist gespeichert. Für einen simulierten Chirurgen fehlt eine Achse.</translation>
    </message>
</context>
<context>
    <name>PracticeRoom</name>
    <message>
        <source>Cannot make the folder %1. Choose a place where you may write.</source>
        <translation>Der Ordner %1 kann nicht angelegt werden. Wählen Sie einen beschreibbaren Ort.</translation>
    </message>
    <message>
        <source>osteon-server is not installed. Install the package osteon-server.</source>
        <translation>osteon-server ist nicht installiert. Installieren Sie das Paket osteon-server.</translation>
    </message>
    <message>
        <source>osteon-haptic is not installed. Install the package osteon.</source>
        <translation>osteon-haptic ist nicht installiert. Installieren Sie das Paket osteon.</translation>
    </message>
    <message>
        <source>The server ended and starts again. Nothing that it acknowledged is lost.</source>
        <translation>Der Server endete und startet neu. Nichts, was er bestätigt hat, ist verloren.</translation>
    </message>
    <message>
        <source>The haptic client ended and starts again.</source>
        <translation>Das Haptikprogramm endete und startet neu.</translation>
    </message>
    <message>
        <source>There is no sound: %1</source>
        <translation>Es gibt keinen Ton: %1</translation>
    </message>
    <message>
        <source>osteon-audio is not installed. Install the package osteon.</source>
        <translation>osteon-audio ist nicht installiert. Installieren Sie das Paket osteon.</translation>
    </message>
    <message>
        <source>Another window has this session open. Close it there, or wait until it has ended.</source>
        <translation>Die Sitzung ist in einem anderen Fenster offen. Schließen Sie es, oder warten Sie.</translation>
    </message>
    <message>
        <source>%1 was ended by force or crashed.</source>
        <translation>%1 wurde gewaltsam beendet oder ist abgestürzt.</translation>
    </message>
    <message>
        <source>%1 ended and gave no reason.</source>
        <translation>%1 endete, ohne einen Grund zu nennen.</translation>
    </message>
    <message>
        <source>The audio client ended and starts again.</source>
        <translation>Das Tonprogramm endete und startet neu.</translation>
    </message>
</context>
<context>
    <name>PropertiesPanel</name>
    <message>
        <source>Tool</source>
        <translation>Werkzeug</translation>
    </message>
    <message>
        <source> rpm</source>
        <translation> U/min</translation>
    </message>
    <message>
        <source>Spindle</source>
        <translation>Drehzahl</translation>
    </message>
    <message>
        <source> N</source>
        <translation> N</translation>
    </message>
    <message>
        <source>Push</source>
        <translation>Andruck</translation>
    </message>
    <message>
        <source>Teeth</source>
        <translation>Zähne</translation>
    </message>
    <message>
        <source>Feed per revolution</source>
        <translation>Vorschub je Umdrehung</translation>
    </message>
    <message>
        <source>%1 mm</source>
        <translation>%1 mm</translation>
    </message>
    <message>
        <source>Wear</source>
        <translation>Verschleiß</translation>
    </message>
    <message>
        <source>Force law</source>
        <translation>Kraftgesetz</translation>
    </message>
    <message>
        <source>The law &quot;%1&quot; in the list of osteon-haptic laws</source>
        <translation>Das Gesetz &quot;%1&quot; in der Liste von osteon-haptic laws</translation>
    </message>
    <message>
        <source>1 is sharp, 2 is blunt. A change acts at once, also while the tool cuts.</source>
        <translation>1 ist scharf, 2 ist stumpf. Eine Änderung wirkt sofort, auch beim Schneiden.</translation>
    </message>
    <message>
        <source>Cutting blunts the tool further. The gauge shows how blunt it is.</source>
        <translation>Schneiden macht das Werkzeug stumpfer. Die Anzeige sagt, wie stumpf es ist.</translation>
    </message>
    <message>
        <source>This tool has no spindle.</source>
        <translation>Dieses Werkzeug hat keine Spindel.</translation>
    </message>
</context>
<context>
    <name>QDockWidget</name>
    <message>
        <source>Float</source>
        <translation>Herauslösen</translation>
    </message>
    <message>
        <source>Undocks and re-attaches the dock widget</source>
        <translation>Löst das Feld aus dem Fenster und setzt es wieder ein</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>Schließen</translation>
    </message>
    <message>
        <source>Closes the dock widget</source>
        <translation>Schließt das Feld</translation>
    </message>
</context>
<context>
    <name>QPlatformTheme</name>
    <message>
        <source>OK</source>
        <translation>OK</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
</context>
<context>
    <name>QShortcut</name>
    <message>
        <source>Ctrl</source>
        <translation>Strg</translation>
    </message>
    <message>
        <source>Shift</source>
        <translation>Umschalt</translation>
    </message>
    <message>
        <source>Home</source>
        <translation>Pos1</translation>
    </message>
    <message>
        <source>Esc</source>
        <translation>Esc</translation>
    </message>
</context>
<context>
    <name>QTabBar</name>
    <message>
        <source>Scroll Left</source>
        <translation>Nach links blättern</translation>
    </message>
    <message>
        <source>Scroll Right</source>
        <translation>Nach rechts blättern</translation>
    </message>
</context>
<context>
    <name>RiskGauge</name>
    <message>
        <source>Distance to the nearest structure at risk</source>
        <translation>Abstand zur nächsten gefährdeten Struktur</translation>
    </message>
    <message>
        <source>Inside %1</source>
        <translation>In: %1</translation>
    </message>
    <message>
        <source>Near %1: %2 mm</source>
        <translation>Nahe an %1: %2 mm</translation>
    </message>
    <message>
        <source>%1: %2 mm</source>
        <translation>%1: %2 mm</translation>
    </message>
    <message>
        <source>Your tool</source>
        <translation>Ihr Werkzeug</translation>
    </message>
    <message>
        <source>%1 (%2): %3</source>
        <translation>%1 (%2): %3</translation>
    </message>
    <message>
        <source>%1: %2</source>
        <translation>%1: %2</translation>
    </message>
</context>
<context>
    <name>ScrollingPlot</name>
    <message>
        <source>Force over the last ten seconds</source>
        <translation>Kraft der letzten zehn Sekunden</translation>
    </message>
    <message>
        <source>%1 N</source>
        <translation>%1 N</translation>
    </message>
</context>
<context>
    <name>SendDialog</name>
    <message>
        <source>Send %1 to a server</source>
        <translation>%1 an einen Server senden</translation>
    </message>
    <message>
        <source>Room to open with it (empty: none)</source>
        <translation>Raum, der damit aufgeht (leer: keiner)</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>Fortschritt</translation>
    </message>
    <message>
        <source>&amp;Send</source>
        <translation>&amp;Senden</translation>
    </message>
    <message>
        <source>Sends the case. The one on this computer stays as it is.</source>
        <translation>Sendet den Fall. Der auf diesem Rechner bleibt, wie er ist.</translation>
    </message>
    <message>
        <source>The server checks the case and keeps it. Whoever may open rooms there can send it.</source>
        <translation>Der Server prüft und behält den Fall. Senden kann, wer dort Räume öffnen darf.</translation>
    </message>
    <message>
        <source>Cancelling…</source>
        <translation>Wird abgebrochen…</translation>
    </message>
    <message>
        <source>The case is being packed</source>
        <translation>Der Fall wird gepackt</translation>
    </message>
    <message>
        <source>Connecting to %1</source>
        <translation>Verbindung zu %1</translation>
    </message>
    <message>
        <source>The case is being sent</source>
        <translation>Der Fall wird gesendet</translation>
    </message>
    <message>
        <source>The server checks the case</source>
        <translation>Der Server prüft den Fall</translation>
    </message>
    <message>
        <source>The server opens the room</source>
        <translation>Der Server öffnet den Raum</translation>
    </message>
    <message>
        <source>The case is being sent. Wait for it, or cancel it.</source>
        <translation>Der Fall wird gesendet. Warten Sie, oder brechen Sie ab.</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>&amp;Close</source>
        <translation>S&amp;chließen</translation>
    </message>
    <message>
        <source>Cancelled. The server stored nothing, and the case here stays.</source>
        <translation>Abgebrochen. Der Server hat nichts gespeichert, und der Fall hier bleibt.</translation>
    </message>
    <message>
        <source>Cancelled. The server stored nothing. Send the case again, or close.</source>
        <translation>Abgebrochen, der Server hat nichts. Senden Sie noch einmal, oder schließen Sie.</translation>
    </message>
    <message>
        <source>On this computer the case stays only if it is sent.</source>
        <translation>Auf diesem Computer bleibt der Fall nur, wenn er gesendet wird.</translation>
    </message>
</context>
<context>
    <name>ServerFields</name>
    <message>
        <source>Folder of your certificate</source>
        <translation>Ordner Ihres Zertifikats</translation>
    </message>
    <message>
        <source>File of your ticket</source>
        <translation>Datei Ihres Tickets</translation>
    </message>
    <message>
        <source>Server, HOST:PORT</source>
        <translation>Server, HOST:PORT</translation>
    </message>
</context>
<context>
    <name>SliceView</name>
    <message>
        <source>%1 mm</source>
        <translation>%1 mm</translation>
    </message>
</context>
<context>
    <name>SlicesPanel</name>
    <message>
        <source>Planes of the slices</source>
        <translation>Ebenen der Schnittbilder</translation>
    </message>
    <message>
        <source>Patient&apos;s axes</source>
        <translation>Achsen des Patienten</translation>
    </message>
    <message>
        <source>Along the tool</source>
        <translation>Entlang des Werkzeugs</translation>
    </message>
    <message>
        <source>Axial, coronal and sagittal, or along the tool and across its tip.</source>
        <translation>Axial, koronal und sagittal, oder entlang des Werkzeugs und quer an seiner Spitze.</translation>
    </message>
    <message>
        <source>Follow the tool</source>
        <translation>Dem Werkzeug folgen</translation>
    </message>
    <message>
        <source>While the tool cuts, the slices go through its tip.</source>
        <translation>Während das Werkzeug schneidet, gehen die Schnittbilder durch seine Spitze.</translation>
    </message>
    <message>
        <source>Window of the slices</source>
        <translation>Fenster der Schnittbilder</translation>
    </message>
    <message>
        <source>Bone</source>
        <translation>Knochen</translation>
    </message>
    <message>
        <source>Soft tissue</source>
        <translation>Weichteile</translation>
    </message>
    <message>
        <source>Wide</source>
        <translation>Weit</translation>
    </message>
    <message>
        <source>By hand</source>
        <translation>Von Hand</translation>
    </message>
    <message>
        <source>Whole bone</source>
        <translation>Ganzer Knochen</translation>
    </message>
    <message>
        <source>The cross in the middle of the bone, and all of it in the images.</source>
        <translation>Das Kreuz in der Mitte des Knochens, und der ganze Knochen in den Bildern.</translation>
    </message>
    <message>
        <source>Axial</source>
        <translation>Axialer Schnitt</translation>
    </message>
    <message>
        <source>Coronal</source>
        <translation>Koronaler Schnitt</translation>
    </message>
    <message>
        <source>Sagittal</source>
        <translation>Sagittaler Schnitt</translation>
    </message>
    <message>
        <source>Along, turned by 90°</source>
        <translation>Entlang, um 90° gedreht</translation>
    </message>
    <message>
        <source>Across the tip</source>
        <translation>Quer an der Spitze</translation>
    </message>
    <message>
        <source>Slice: %1</source>
        <translation>Regler: %1</translation>
    </message>
    <message>
        <source>%1 HU at %2, %3, %4 mm</source>
        <translation>%1 HU bei %2, %3, %4 mm</translation>
    </message>
    <message>
        <source>The bone is fetched…</source>
        <translation>Der Knochen wird geholt…</translation>
    </message>
    <message>
        <source>The slices are computed, %1 %</source>
        <translation>Die Schnittbilder werden berechnet, %1 %</translation>
    </message>
    <message>
        <source>Connection lost: the slices show the bone as it was.</source>
        <translation>Verbindung verloren: Die Schnittbilder zeigen den Knochen, wie er war.</translation>
    </message>
    <message>
        <source>The slices show the density of the case, not its scan: %1</source>
        <translation>Die Schnittbilder zeigen die Dichte des Falls, nicht seinen Scan: %1</translation>
    </message>
    <message>
        <source>Which HU are black and white. Drag with the right button to change it.</source>
        <translation>Welche HU schwarz und weiß sind. Ziehen mit der rechten Taste ändert es.</translation>
    </message>
    <message>
        <source>Left button or arrows: the cross. Middle button: the image moves.</source>
        <translation>Linke Taste oder Pfeile: das Kreuz. Mittlere Taste: das Bild wandert.</translation>
    </message>
    <message>
        <source>Right button: to the right a wider window of HU, down a darker image.</source>
        <translation>Rechte Taste: nach rechts ein weiteres Fenster der HU, nach unten ein dunkleres Bild.</translation>
    </message>
    <message>
        <source>Wheel, or Page Up and Page Down: the next slice.</source>
        <translation>Rad, oder Bild auf und Bild ab: der nächste Schnitt.</translation>
    </message>
    <message>
        <source>Ctrl and wheel, or + and -: nearer or farther.</source>
        <translation>Strg und Rad, oder + und -: näher oder ferner.</translation>
    </message>
</context>
<context>
    <name>SolidView</name>
    <message>
        <source>Three dimensions</source>
        <translation>Drei Dimensionen</translation>
    </message>
    <message>
        <source>A click chooses the bone in the list.</source>
        <translation>Ein Klick wählt den Knochen in der Liste.</translation>
    </message>
    <message>
        <source>A double click or Enter moves the crosshair too.</source>
        <translation>Ein Doppelklick oder die Eingabetaste bewegt auch das Fadenkreuz.</translation>
    </message>
    <message>
        <source>A drag turns the picture, the wheel brings it nearer, and Home shows all.</source>
        <translation>Ziehen dreht das Bild, das Rad holt es näher, und Pos1 zeigt alles.</translation>
    </message>
</context>
<context>
    <name>SoundControl</name>
    <message>
        <source>There is no sound: %1</source>
        <translation>Es gibt keinen Ton: %1</translation>
    </message>
    <message>
        <source>The window plays only the rooms that it opened. To hear this one, start: %1</source>
        <translation>Das Fenster spielt nur Räume, die es öffnete. Starten Sie für diesen: %1</translation>
    </message>
    <message>
        <source>Only a practice room has sound. Open a bone first.</source>
        <translation>Ton gibt es nur in einem Übungsraum. Öffnen Sie zuerst einen Knochen.</translation>
    </message>
    <message>
        <source>The audio client has not reported yet.</source>
        <translation>Das Tonprogramm hat sich noch nicht gemeldet.</translation>
    </message>
    <message>
        <source>The sound is off.</source>
        <translation>Der Ton ist aus.</translation>
    </message>
</context>
<context>
    <name>SoundDialog</name>
    <message>
        <source>Sound</source>
        <translation>Ton</translation>
    </message>
    <message>
        <source>&amp;Play the sound</source>
        <translation>Ton &amp;abspielen</translation>
    </message>
    <message>
        <source>Volume</source>
        <translation>Lautstärke</translation>
    </message>
    <message>
        <source>%1 %</source>
        <translation>%1 %</translation>
    </message>
    <message>
        <source>&amp;Volume</source>
        <translation>&amp;Lautstärke</translation>
    </message>
    <message>
        <source>Level</source>
        <translation>Pegel</translation>
    </message>
    <message>
        <source>Computing time of a buffer</source>
        <translation>Rechenzeit je Puffer</translation>
    </message>
    <message>
        <source>Latency from tool to ear, at most</source>
        <translation>Latenz vom Werkzeug zum Ohr, höchstens</translation>
    </message>
    <message>
        <source>Gaps</source>
        <translation>Aussetzer</translation>
    </message>
    <message>
        <source>Late callbacks</source>
        <translation>Verspätete Aufrufe</translation>
    </message>
    <message>
        <source>Device</source>
        <translation>Gerät</translation>
    </message>
    <message>
        <source>Close</source>
        <translation>Schließen</translation>
    </message>
    <message>
        <source>silent</source>
        <translation>still</translation>
    </message>
    <message>
        <source>%1 dB</source>
        <translation>%1 dB</translation>
    </message>
    <message>
        <source>%1 of %2 ms</source>
        <translation>%1 von %2 ms</translation>
    </message>
    <message>
        <source>%1 ms</source>
        <translation>%1 ms</translation>
    </message>
    <message>
        <source>No sound device: %1</source>
        <translation>Kein Tongerät: %1</translation>
    </message>
    <message>
        <source>no sound server answers; start PulseAudio or PipeWire.</source>
        <translation>Kein Tonserver antwortet; starten Sie PulseAudio oder PipeWire.</translation>
    </message>
    <message>
        <source>the sound server went away; start it again.</source>
        <translation>Der Tonserver ist fort; starten Sie ihn neu.</translation>
    </message>
    <message>
        <source>the sound has not begun yet.</source>
        <translation>Der Ton hat noch nicht begonnen.</translation>
    </message>
    <message>
        <source>The sound is off.</source>
        <translation>Der Ton ist aus.</translation>
    </message>
</context>
<context>
    <name>StartPage</name>
    <message>
        <source>Practise bone surgery. For research and teaching; not a medical device.</source>
        <translation>Üben Sie Knochenchirurgie. Für Forschung und Lehre; kein Medizinprodukt.</translation>
    </message>
    <message>
        <source>Bones to practise on</source>
        <translation>Knochen zum Üben</translation>
    </message>
    <message>
        <source>Go on with</source>
        <translation>Weiter mit</translation>
    </message>
    <message>
        <source>Your own</source>
        <translation>Eigene Daten</translation>
    </message>
    <message>
        <source>Progress</source>
        <translation>Fortschritt</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Sessions to go on with</source>
        <translation>Sitzungen zum Fortsetzen</translation>
    </message>
    <message>
        <source>&amp;Import a CT…</source>
        <translation>CT &amp;importieren…</translation>
    </message>
    <message>
        <source>Make a case from a folder of DICOM files, a zip or ISO file, NIfTI, NRRD or MetaImage</source>
        <translation>Erzeugt einen Fall aus DICOM (Ordner, Zip, ISO), NIfTI, NRRD oder MetaImage</translation>
    </message>
    <message>
        <source>&amp;Open a case…</source>
        <translation>Fall öff&amp;nen…</translation>
    </message>
    <message>
        <source>&amp;Join a room…</source>
        <translation>Einem &amp;Raum beitreten…</translation>
    </message>
    <message>
        <source>Join a room on a server, with certificate and ticket</source>
        <translation>Tritt einem Raum auf einem Server bei, mit Zertifikat und Ticket</translation>
    </message>
    <message>
        <source>Open an .osteon file, or the case.json of a folder</source>
        <translation>Öffnet eine .osteon-Datei oder die case.json eines Ordners</translation>
    </message>
    <message>
        <source>A bone or a room is being opened. Wait for it, or cancel it.</source>
        <translation>Ein Knochen oder Raum wird geöffnet. Warten Sie, oder brechen Sie ab.</translation>
    </message>
</context>
<context>
    <name>Structures</name>
    <message>
        <source>femur</source>
        <translation>Femur</translation>
    </message>
    <message>
        <source>tibia</source>
        <translation>Tibia</translation>
    </message>
    <message>
        <source>patella</source>
        <translation>Patella</translation>
    </message>
    <message>
        <source>pelvis</source>
        <translation>Becken</translation>
    </message>
    <message>
        <source>mechanical axis</source>
        <translation>mechanische Achse</translation>
    </message>
    <message>
        <source>anatomical axis</source>
        <translation>anatomische Achse</translation>
    </message>
    <message>
        <source>neck axis</source>
        <translation>Schenkelhalsachse</translation>
    </message>
    <message>
        <source>transepicondylar axis</source>
        <translation>transepikondyläre Achse</translation>
    </message>
    <message>
        <source>posterior condylar axis</source>
        <translation>hintere Kondylenachse</translation>
    </message>
    <message>
        <source>plateau slope</source>
        <translation>Neigung des Plateaus</translation>
    </message>
    <message>
        <source>patellar ridge</source>
        <translation>Patellafirst</translation>
    </message>
    <message>
        <source>femoral head cartilage</source>
        <translation>Hüftkopfknorpel</translation>
    </message>
    <message>
        <source>femoral condyle cartilage</source>
        <translation>Kondylenknorpel</translation>
    </message>
    <message>
        <source>patellar cartilage</source>
        <translation>Patellaknorpel</translation>
    </message>
    <message>
        <source>tibial cartilage</source>
        <translation>Tibiaknorpel</translation>
    </message>
    <message>
        <source>acetabular cartilage</source>
        <translation>Pfannenknorpel</translation>
    </message>
    <message>
        <source>left acetabular cartilage</source>
        <translation>linker Pfannenknorpel</translation>
    </message>
    <message>
        <source>right acetabular cartilage</source>
        <translation>rechter Pfannenknorpel</translation>
    </message>
    <message>
        <source>acetabular opening</source>
        <translation>Pfannenöffnung</translation>
    </message>
    <message>
        <source>left acetabular opening</source>
        <translation>linke Pfannenöffnung</translation>
    </message>
    <message>
        <source>right acetabular opening</source>
        <translation>rechte Pfannenöffnung</translation>
    </message>
    <message>
        <source>femoral artery</source>
        <translation>Arteria femoralis</translation>
    </message>
    <message>
        <source>popliteal artery</source>
        <translation>Arteria poplitea</translation>
    </message>
    <message>
        <source>anterior tibial artery</source>
        <translation>Arteria tibialis anterior</translation>
    </message>
    <message>
        <source>sciatic nerve</source>
        <translation>Nervus ischiadicus</translation>
    </message>
    <message>
        <source>tibial nerve</source>
        <translation>Nervus tibialis</translation>
    </message>
    <message>
        <source>common peroneal nerve</source>
        <translation>Nervus fibularis communis</translation>
    </message>
    <message>
        <source>anterior cruciate ligament</source>
        <translation>vorderes Kreuzband</translation>
    </message>
    <message>
        <source>posterior cruciate ligament</source>
        <translation>hinteres Kreuzband</translation>
    </message>
    <message>
        <source>medial collateral ligament</source>
        <translation>Innenband</translation>
    </message>
    <message>
        <source>lateral collateral ligament</source>
        <translation>Außenband</translation>
    </message>
    <message>
        <source>patellar ligament</source>
        <translation>Patellarsehne</translation>
    </message>
    <message>
        <source>fibula</source>
        <translation>Fibula</translation>
    </message>
</context>
<context>
    <name>Tools</name>
    <message>
        <source>Tools</source>
        <translation>Werkzeuge</translation>
    </message>
    <message>
        <source>Femoral broach</source>
        <translation>Femurraspel</translation>
    </message>
    <message>
        <source>Tibial keel broach</source>
        <translation>Raspel für den Tibiakiel</translation>
    </message>
    <message>
        <source>Barrel bur 6 mm</source>
        <translation>Tonnenfräse 6 mm</translation>
    </message>
    <message>
        <source>Contoured cutting bur 4 mm</source>
        <translation>Konturfräse 4 mm</translation>
    </message>
    <message>
        <source>Round bur 3.2 mm</source>
        <translation>Kugelfräse 3,2 mm</translation>
    </message>
    <message>
        <source>Round bur 5 mm</source>
        <translation>Kugelfräse 5 mm</translation>
    </message>
    <message>
        <source>Round bur 6 mm</source>
        <translation>Kugelfräse 6 mm</translation>
    </message>
    <message>
        <source>Drill 1/8 inch</source>
        <translation>Bohrer 1/8 Zoll</translation>
    </message>
    <message>
        <source>Drill 3.2 mm</source>
        <translation>Bohrer 3,2 mm</translation>
    </message>
    <message>
        <source>Drill 3.5 mm</source>
        <translation>Bohrer 3,5 mm</translation>
    </message>
    <message>
        <source>Drill 5/16 inch</source>
        <translation>Bohrer 5/16 Zoll</translation>
    </message>
    <message>
        <source>End drill 9.5 mm</source>
        <translation>Stirnbohrer 9,5 mm</translation>
    </message>
    <message>
        <source>Drill sleeve 3.2 mm</source>
        <translation>Bohrhülse 3,2 mm</translation>
    </message>
    <message>
        <source>Distal cutting block</source>
        <translation>Distaler Schnittblock</translation>
    </message>
    <message>
        <source>4-in-1 cutting block</source>
        <translation>4-in-1-Schnittblock</translation>
    </message>
    <message>
        <source>Headless pin 1/8 inch</source>
        <translation>Pin ohne Kopf 1/8 Zoll</translation>
    </message>
    <message>
        <source>Headed pin 1/8 inch</source>
        <translation>Pin mit Kopf 1/8 Zoll</translation>
    </message>
    <message>
        <source>Steinmann pin 4 mm</source>
        <translation>Steinmann-Nagel 4 mm</translation>
    </message>
    <message>
        <source>Cylindrical reamer 12 mm</source>
        <translation>Zylinderfräse 12 mm</translation>
    </message>
    <message>
        <source>Cylindrical outside reamer 46 mm</source>
        <translation>Zylindrische Außenfräse 46 mm</translation>
    </message>
    <message>
        <source>Acetabular reamer 50 mm</source>
        <translation>Pfannenfräse 50 mm</translation>
    </message>
    <message>
        <source>Oscillating saw 25 mm</source>
        <translation>Oszillierende Säge 25 mm</translation>
    </message>
    <message>
        <source>Oscillating saw 19 mm</source>
        <translation>Oszillierende Säge 19 mm</translation>
    </message>
    <message>
        <source>Oscillating saw 9.5 mm</source>
        <translation>Oszillierende Säge 9,5 mm</translation>
    </message>
    <message>
        <source>Reciprocating saw</source>
        <translation>Stichsäge</translation>
    </message>
    <message>
        <source>Cortical screw 3.5 mm</source>
        <translation>Kortikalisschraube 3,5 mm</translation>
    </message>
    <message>
        <source>Cortical screw 4.5 mm</source>
        <translation>Kortikalisschraube 4,5 mm</translation>
    </message>
    <message>
        <source>Cancellous screw 6.5 mm</source>
        <translation>Spongiosaschraube 6,5 mm</translation>
    </message>
    <message>
        <source>Trial cup 50 mm</source>
        <translation>Probepfanne 50 mm</translation>
    </message>
    <message>
        <source>Trial stem</source>
        <translation>Probeschaft</translation>
    </message>
    <message>
        <source>Drills</source>
        <translation>Bohrer</translation>
    </message>
    <message>
        <source>Burs</source>
        <translation>High-Speed-Fräsen</translation>
    </message>
    <message>
        <source>Saws</source>
        <translation>Sägen</translation>
    </message>
    <message>
        <source>Reamers</source>
        <translation>Pfannen- und Zylinderfräsen</translation>
    </message>
    <message>
        <source>Broaches</source>
        <translation>Raspeln</translation>
    </message>
    <message>
        <source>Guides and trials</source>
        <translation>Führungen und Probeimplantate</translation>
    </message>
    <message>
        <source>Pins</source>
        <translation>Pins und Nägel</translation>
    </message>
    <message>
        <source>Screws</source>
        <translation>Schrauben</translation>
    </message>
    <message>
        <source>Measured thrust</source>
        <translation>Gemessene Vorschubkraft</translation>
    </message>
    <message>
        <source>Energy of the removed volume</source>
        <translation>Energie des entfernten Volumens</translation>
    </message>
    <message>
        <source>Erosion</source>
        <translation>Abtrag</translation>
    </message>
    <message>
        <source>Milling</source>
        <translation>Fräsen</translation>
    </message>
    <message>
        <source>Spring and damper</source>
        <translation>Feder und Dämpfer</translation>
    </message>
    <message>
        <source>Sum over contact points</source>
        <translation>Summe über Kontaktpunkte</translation>
    </message>
    <message>
        <source>Single teeth of a saw</source>
        <translation>Einzelne Zähne einer Säge</translation>
    </message>
    <message>
        <source>Reaming</source>
        <translation>Aufreiben</translation>
    </message>
    <message>
        <source>Blows of a mallet</source>
        <translation>Schläge eines Hammers</translation>
    </message>
</context>
<context>
    <name>Tour</name>
    <message>
        <source>&amp;Next step</source>
        <translation>&amp;Nächster Schritt</translation>
    </message>
    <message>
        <source>End the tour</source>
        <translation>Rundgang beenden</translation>
    </message>
    <message>
        <source>Open a bone: click on the skull, or choose it with the arrow keys and press Enter.</source>
        <translation>Knochen öffnen: Schädel anklicken, oder mit Pfeiltasten wählen und Eingabetaste.</translation>
    </message>
    <message>
        <source>Take a tool: click on the drill in this bar, or choose it in the menu Tools.</source>
        <translation>Werkzeug nehmen: in dieser Leiste den Bohrer anklicken, oder im Menü Werkzeuge.</translation>
    </message>
    <message>
        <source>Point at the bone and hold the left button. A hand then pushes the tool in.</source>
        <translation>Auf den Knochen zeigen, linke Taste halten: Eine Hand drückt das Werkzeug hinein.</translation>
    </message>
    <message>
        <source>Turn the wheel over the bone, or change this number: it is how hard the hand pushes.</source>
        <translation>Mausrad über dem Knochen, oder diese Zahl ändern: So stark drückt die Hand.</translation>
    </message>
    <message>
        <source>Undo, also Ctrl+Z, takes back the last push. Help &gt; Tour shows these steps again.</source>
        <translation>Rückgängig (Strg+Z) nimmt den letzten Druck zurück. Der Rundgang: Menü Hilfe.</translation>
    </message>
    <message>
        <source>Step %1 of %2</source>
        <translation>Schritt %1 von %2</translation>
    </message>
    <message>
        <source>&amp;Done</source>
        <translation>&amp;Fertig</translation>
    </message>
</context>
<context>
    <name>ViewOptions</name>
    <message>
        <source>Orientation cube</source>
        <translation>Orientierungswürfel</translation>
    </message>
    <message>
        <source>Stereo picture</source>
        <translation>Stereobild</translation>
    </message>
    <message>
        <source>Saved views</source>
        <translation>Gespeicherte Ansichten</translation>
    </message>
    <message>
        <source>Save this view</source>
        <translation>Diese Ansicht speichern</translation>
    </message>
    <message>
        <source>Delete the saved views</source>
        <translation>Gespeicherte Ansichten löschen</translation>
    </message>
    <message>
        <source>View %1</source>
        <translation>Ansicht %1</translation>
    </message>
    <message>
        <source>Off</source>
        <translation>Aus</translation>
    </message>
    <message>
        <source>Anaglyph, for red and cyan glasses</source>
        <translation>Anaglyph, für Rot-Cyan-Brillen</translation>
    </message>
    <message>
        <source>Side by side</source>
        <translation>Nebeneinander</translation>
    </message>
    <message>
        <source>Quad buffer</source>
        <translation>Quad-Buffer</translation>
    </message>
    <message>
        <source>This display has no quad buffer, so stereo is off. Choose anaglyph or side by side.</source>
        <translation>Kein Quad-Buffer, deshalb ist Stereo aus. Wählen Sie Anaglyph oder Nebeneinander.</translation>
    </message>
    <message>
        <source>Nine views are saved already. Delete them first.</source>
        <translation>Neun Ansichten sind schon gespeichert. Löschen Sie diese zuerst.</translation>
    </message>
    <message>
        <source>Saved as view %1.</source>
        <translation>Als Ansicht %1 gespeichert.</translation>
    </message>
    <message>
        <source>Planned axes and regions</source>
        <translation>Geplante Achsen und Bereiche</translation>
    </message>
    <message>
        <source>Structures at risk</source>
        <translation>Gefährdete Strukturen</translation>
    </message>
    <message>
        <source>Overlays</source>
        <translation>Einblendungen</translation>
    </message>
</context>
<context>
    <name>WavePlot</name>
    <message>
        <source>Waveform of the sound</source>
        <translation>Wellenform des Tons</translation>
    </message>
    <message>
        <source>%1 ms</source>
        <translation>%1 ms</translation>
    </message>
</context>
</TS>
