"""lumend from Python: edit a scene, see its pictures, measure its light.

    import lumend

    with lumend.connect("http://127.0.0.1:9460/#t=TOKEN") as session:
        with session.edit() as edit:
            edit.set("ceiling-panel", flux_lm=5500)
        with session.view(600, 400, spp=64) as view:
            view.picture().save_png("room.png")
        print(session.probe([0, 0.75, 0], [0, 1, 0])["illuminance_lx"])

Python's standard library is enough.
"""
from lumend.picture import Picture
from lumend.session import Edit, Refused, Session, View
from lumend.websocket import Disconnected

__all__ = ["Disconnected", "Edit", "Picture", "Refused", "Session", "View", "connect"]

connect = Session
