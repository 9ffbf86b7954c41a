/**
 * The console's video alone on a page, for `python -m bench video`: what a browser needs to show it is not mixed with
 * what it needs for the map beside it. ?drone=1&quality=medium&codec=mpeg1&width=320&height=240
 */

import { mount } from 'svelte';

import VideoView from '../../src/video/VideoView.svelte';
import type { CodecChoice, QualityName } from '../../src/video/video_types';

const asked = new URLSearchParams(location.search);
const place = document.getElementById('place') as HTMLElement;
place.style.width = `${asked.get('width')}px`;
place.style.height = `${asked.get('height')}px`;

mount(VideoView, {
  target: place,
  props: {
    droneId: Number(asked.get('drone')),
    droneName: 'Kestrel',
    quality: asked.get('quality') as QualityName,
    codec: asked.get('codec') as CodecChoice,
  },
});
