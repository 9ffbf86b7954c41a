"""Brings pictures of any size to that of the file: as large as fits, black around it, never stretched."""

from typing import Final

from av.filter import Graph
from av.video.frame import VideoFrame

_MAX_GRAPHS: Final = 8


class Fitting:
    """`width`, `height`: of the file, even."""

    def __init__(self, width: int, height: int) -> None:
        self._size = (width, height)
        self._graphs: dict[tuple[int, int, str], Graph] = {}

    def fit(self, frame: VideoFrame) -> VideoFrame:
        """The same picture in yuv420p and in the size of the file."""
        if (frame.width, frame.height) == self._size and frame.format.name == "yuv420p":
            return frame
        key = (frame.width, frame.height, frame.format.name)
        graph = self._graphs.get(key)
        if graph is None:
            if len(self._graphs) >= _MAX_GRAPHS:
                self._graphs.clear()
            graph = self._graphs[key] = self._new_graph(frame)
        graph.push(frame)
        fitted = graph.pull()
        assert isinstance(fitted, VideoFrame)
        return fitted

    def _new_graph(self, frame: VideoFrame) -> Graph:
        width, height = self._size
        graph = Graph()
        last = graph.add_buffer(width=frame.width, height=frame.height, format=frame.format, time_base=frame.time_base)
        for name, settings in (
            ("scale", f"{width}:{height}:force_original_aspect_ratio=decrease:force_divisible_by=2"),
            ("pad", f"{width}:{height}:(ow-iw)/2:(oh-ih)/2"),
            ("setsar", "1"),
            ("format", "yuv420p"),
            ("buffersink", ""),
        ):
            node = graph.add(name, settings) if settings else graph.add(name)
            last.link_to(node)
            last = node
        graph.configure()
        return graph
