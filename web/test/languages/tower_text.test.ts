import { afterEach, beforeEach, describe, expect, it } from 'vitest';

import { tower as PORTUGUESE } from '../../src/languages/pt/portuguese';
import { useCatalogue } from '../../src/languages/text';
import { inTowerWords, towerText, useTowerTexts, type TowerTexts } from '../../src/languages/tower_text';

const TEXTS: TowerTexts = {
  'there is no such drone': 'não há tal drone',
  '{name} is offline.': '{name} está desligado.',
  '{name} is at {height:number} m, above {limit:number} m.': '{name} está a {height} m, acima de {limit} m.',
  '{name} holds: {why:text}.': '{name} pára: {why}.',
  'the no-fly zone {name}': 'zona de exclusão {name}',
  'leads into {words:text}': 'leva para dentro da {words}',
  'The way {words:text}': 'O caminho {words}',
  '{name} holds: {why:text}, and nobody flies it.': '{name} pára: {why}, e ninguém o pilota.',
  'it is level': 'está nivelado',
  'it has a position': 'tem posição',
  ' and ': ' e ',
  blank: '',
};

beforeEach(() => {
  useCatalogue('pt', {});
  useTowerTexts(TEXTS);
});
afterEach(() => {
  useCatalogue('en', null);
  useTowerTexts(null);
});

describe('a text of the tower', () => {
  it('is translated whole, with its values as they are', () => {
    expect(towerText('there is no such drone')).toBe('não há tal drone');
    expect(towerText('Merlin 2 is offline.')).toBe('Merlin 2 está desligado.');
  });

  it('has its numbers as the language writes them', () => {
    expect(towerText('Merlin is at 120.5 m, above 100 m.')).toBe('Merlin está a 120,5 m, acima de 100 m.');
    expect(towerText('Merlin is at home m, above 100 m.')).toBe('Merlin is at home m, above 100 m.');
  });

  it('has texts as values, and lists of them', () => {
    expect(towerText('Merlin holds: it is level.')).toBe('Merlin pára: está nivelado.');
    expect(towerText('Merlin holds: it is level and it has a position.')).toBe(
      'Merlin pára: está nivelado e tem posição.',
    );
    expect(towerText('The way leads into the no-fly zone Big Airport')).toBe(
      'O caminho leva para dentro da zona de exclusão Big Airport',
    );
  });

  it('keeps a value that is no text of the catalogue: what an autopilot or a person said', () => {
    expect(towerText('Merlin holds: Airspace closed.')).toBe('Merlin pára: Airspace closed.');
    expect(towerText('Airspace closed')).toBe('Airspace closed');
  });

  it('never translates a name, even one that is a text', () => {
    expect(towerText('it is level is offline.')).toBe('it is level está desligado.');
  });

  it('is that of the pattern with more words, where two match', () => {
    expect(towerText('Merlin holds: it is level, and nobody flies it.')).toBe(
      'Merlin pára: está nivelado, e ninguém o pilota.',
    );
  });

  it('may begin with the other case, end with a full stop, or be several sentences', () => {
    expect(towerText('There is no such drone.')).toBe('Não há tal drone.');
    expect(towerText('Merlin is offline. Nobody knows why.')).toBe('Merlin está desligado. Nobody knows why.');
  });

  it('stays English where nobody translated it, and for readers of English', () => {
    expect(towerText('blank')).toBe('blank');
    expect(towerText('')).toBe('');
    useTowerTexts(null);
    expect(towerText('there is no such drone')).toBe('there is no such drone');
  });

  it('is translated in the named parts of an object only', () => {
    const event = { reason: 'there is no such drone', name: 'there is no such drone', drone: null };
    expect(inTowerWords(event, 'reason', 'drone')).toEqual({ ...event, reason: 'não há tal drone' });
  });
});

describe('the Portuguese catalogue', () => {
  beforeEach(() => useTowerTexts(PORTUGUESE));

  it.each([
    [
      'Merlin lost its link in the air at 40 m. It was flown by hand; it holds, then it returns after 30 s without the tower, if its agent is alive.',
      'Merlin perdeu a ligação no ar a 40 m. O drone era pilotado à mão; fica parado, depois regressa após 30 s sem a torre, se o seu agente estiver ativo.',
    ],
    [
      'Nobody flies Merlin (alice released the controls). It returns at 12:00:05 UTC, unless somebody flies it or says "stay".',
      'Ninguém pilota Merlin (alice largou os comandos). O drone regressa às 12:00:05 UTC, a não ser que alguém o pilote ou diga "ficar".',
    ],
    ['Merlin is in the no-fly zone Airport (fair).', 'Merlin está dentro da zona de exclusão Airport (fair).'],
    [
      'Merlin reaches the no-fly zone Airport in about 15 s, 120 m ahead.',
      'Merlin chega à zona de exclusão Airport dentro de cerca de 15 s, 120 m à frente.',
    ],
    ['the tower is lost: return in 12 s', 'perdeu-se a torre: regressar dentro de 12 s'],
    ['Merlin holds: at the edge of the no-fly zone Airport.', 'Merlin pára: no limite da zona de exclusão Airport.'],
    [
      "The battery of Merlin is low by its autopilot's threshold: 18 %.",
      'A bateria de Merlin está fraca segundo o limiar do seu piloto automático: 18 %.',
    ],
    [
      '2 dangers on a loss, not acknowledged: read the check before flight.',
      '2 perigos numa perda, não confirmados: leia a verificação antes do voo.',
    ],
    [
      'Merlin is offline: nothing was sent to it, and nothing will be sent later',
      'Merlin está desligado da torre: nada lhe foi enviado, e nada será enviado mais tarde',
    ],
  ])('says "%s"', (english, portuguese) => {
    expect(towerText(english)).toBe(portuguese);
  });
});
