"""Words for columns in European and East Asian languages, with the role of each word."""

import re
import unicodedata
from functools import lru_cache

ROLES = {
    "time": "time t zeit zeitachse temps tempo tiempo uhrzeit timestamp timestamps zeitstempel horodatage elapsed "
    "clock tijd tijdstip hora heure ora orario zeitpunkt instant prufzeit messzeit messdauer tid czas время cas "
    "zaman aika ido timp laufzeit час χρονος الزمن זמן 時間 時刻 経過時間 时间 時間軸 시간",
    "date": "date datum fecha data datetime",
    "input": "input inputs eingang eingabe entree entrees entrada ingresso uin xin x position positions pos stage "
    "displacement displacements disp displ encoder drive travel stroke weg stellweg wege hub verschiebung verfahrweg "
    "antrieb vorschub lage istposition istweg deplacement deplacements course actionneur codeur posicion "
    "desplazamiento desplazamientos carrera actuador posizione spostamento spostamenti corsa attuatore u_in actuator "
    "positie posities verplaatsing slag aandrijving posicao posicoes deslocamento deslocamentos traversenweg crosshead "
    "konum sijainti asema siirtyma pozicio elmozdulas pozitie положення forskydning forskjutning polozenie "
    "przemieszczenie posuv poloha "
    "vandring plassering θεση μετατοπιση الموضع מיקום "
    "положение перемещение позиция 変位 位置 変位量 "
    "ストローク 位移 行程 변위 위치",
    "gap": "gap gaps opening openings abstand abstande oeffnung offnung offnungsweite oeffnungsweite spalt spaltweite "
    "greiferoffnung greiferoeffnung greifweite fingerabstand backenabstand aperture clearance separation ouverture "
    "ecartement espacement apertura abertura hueco separacion separazione fessura luce "
    "spleet spleetbreedte vingerafstand afstand abertura aberturas separacao entrefer avstand szczelina odstep "
    "rozwarcie mezera aciklik aralik rako hezag deschidere "
    "oppning abning apning spalte διακενο ανοιγμα الفجوة מרווח abst "
    "зазор раскрытие 隙間 すき間 間隙 間隔 ギャップ 開口 间隙 间距 開度 开口 간격 틈새",
    "left": "left links linke linker linkes gauche izquierda izquierdo sinistra sinistro esquerda esquerdo",
    "right": "right rechts rechte rechter rechtes droite droit derecha derecho destra destro direita direito",
    "force": "force forces kraft krafte kraefte stellkraft f load effort fuerza fuerzas forza forze carga "
    "kracht forca forcas сила усилие 力 荷重 힘",
    "run": "run runs lauf versuch essai ensayo corrida prova messreihe serie series trial meting ensaio",
    "target": "target targets soll sollposition sollwert sollweg nominal nominale cible objetivo obiettivo consigne "
    "zielposition ziel command commanded setpoint setpoints demand demanded fuhrungsgrosse sollgrosse",
    "direction": "direction richtung sens direccion direzione anfahrrichtung approach side",
    "cycle": "cycle cycles zyklus zyklen ciclo ciclos cicli",
    "deviation": "deviation deviations abweichung abweichungen desviacion scostamento deviazione positionsabweichung",
}
BESIDE = (
    "the of a an and in at im der die das des de du la le les el los il lo dei del della channel ch kanal canal canale "
    "axis achse axe eje asse signal signals measured gemessen gemessene mesure mesuree medido medida misurato misurata "
    "actual ist current aktuell aktuelle actuelle value values wert werte valeur valor valore reading readback number "
    "no nr num finger fingers fingern zwischen tip tips tisch table linear motor piezo mean mittel mittelwert moyenne "
    "media laser edge kante edges total relative relativ raw roh stepper gripper greifer pince pinza doigt doigts dedo "
    "dedos dita dito entre tra fra machine between jaw jaws backen messung data daten donnees datos dati x y z 0 1 "
    "2 3 4 prescribed imposed applied vorgegebene vorgegebener vorgegebenes aufgebrachte imposee impose impuesto "
    "impuesta imposto imposta imposti feedback vib vibrometer fiber fibre width weite breite largeur ancho larghezza "
    "axial axiale mech utc local "
    "sensor sonde probe capacitive confocal inductive optical act akt 測定 計測 測定値 测量 측정"
)
FILLERS = frozenset(unicodedata.normalize("NFKD", BESIDE).split())
"""Filler words, which do not change the role of the other words in a name."""
MEASUREMENT = (
    "experiment experimental experimentell exp measured measurement measurements messung gemessen mesure mesures "
    "medido medicion misura misurato test versuch essai"
)
OF_MEASUREMENT = frozenset(MEASUREMENT.split())
SIMULATION = (
    "simulation simulated sim simuliert simule simulacion simulazione comsol ansys abaqus simmechanics simscape "
    "simulink matlab fem fea model modell modele modelo modello theory theorie theoretical analytical analytisch "
    "rechnung calculated berechnet solidworks"
)
OF_SIMULATION = frozenset(SIMULATION.split())
"""Words that denote the source of a column of gaps in tables with several sources."""


def tokens(name: str) -> tuple[str, ...]:
    """Split a name into words, in lower case and without accents; camelCase is split as well.

    Examples
    --------
    >>> tokens("Öffnungsweite_links")
    ('offnungsweite', 'links')
    >>> tokens("stagePosition 1")
    ('stage', 'position', '1')
    """
    if re.fullmatch(r"[uxUX]_in", name.strip()):
        return ("uin",) if name.strip().lower() == "u_in" else ("xin",)
    name = re.sub(r"(?<=[a-zà-ÿ])(?=[A-ZÀ-Ý][a-zà-ÿ])", " ", name.replace("ß", "ss"))
    return tuple(re.findall(r"[^\W_]+", _plain(name)))


def _plain(name: str) -> str:
    """Lower case without accents; `ł` and `ø` are not letters with an accent, and are replaced separately."""
    apart = unicodedata.normalize("NFKD", name)
    letters = "".join(letter for letter in apart if not unicodedata.combining(letter)).lower()
    return letters.translate(WITHOUT_STROKE)


WITHOUT_STROKE = str.maketrans("łøđı", "lodi")
BY_TOKEN = {_plain(word): role for role, words in ROLES.items() for word in words.split()}
NUMBERED = re.compile(r"([^\W\d_]+)\d+")
"""A word that ends with a number: `ch0`, `position1`, `ai1`."""


def _meaning(word: str) -> str:
    """Remove the number of a channel from the end of a word, if the shorter word is known."""
    if word in BY_TOKEN or word in FILLERS:
        return word
    bare = NUMBERED.fullmatch(word)
    return bare[1] if bare is not None and len(bare[1]) > 1 and (bare[1] in BY_TOKEN or bare[1] in FILLERS) else word


@lru_cache(maxsize=65_536)
def role_of(name: str) -> str | None:
    """Role denoted by a name without its unit; None for an unknown or ambiguous name.

    A name has a role if one of its words has a role and all other words are filler words. In `time stamp` the word
    `stamp` is a filler; in `start time` the word `start` is not.

    Examples
    --------
    >>> role_of("Abstand der Finger"), role_of("Position Achse 1"), role_of("left finger position")
    ('gap', 'input', 'left')
    >>> role_of("disp"), role_of("Prescribed displacement"), role_of("Vorgegebene Verschiebung")
    ('input', 'input', 'input')
    >>> role_of("102 <Gap>"), role_of("Position Ch0"), role_of("変位"), role_of("Położenie")
    ('gap', 'input', 'input', 'input')
    >>> role_of("room temperature"), role_of("gap error")
    (None, None)

    A lower-case u denotes a standard uncertainty, and so does a capital U in a name of capitals only; otherwise a
    capital U denotes an expanded uncertainty and has no role.

    >>> role_of("u_gap"), role_of("u(gap)"), role_of("U_RANDOM"), role_of("U_gap")
    ('u_gap', 'u_gap', 'u_random', None)
    """
    words = tokens(name)
    if (
        standard := re.fullmatch(r"(?:u|U(?=[^a-z]*$))(?:_| ?\(|\s+)(gap|random|GAP|RANDOM)\)?", name.strip())
    ) is not None:
        return f"u_{standard[1].lower()}"
    if words in {("time", "stamp"), ("date", "time"), ("marca", "de", "tiempo")}:
        return "time"
    meanings = [_meaning(word) for word in words]
    roles = [BY_TOKEN[word] for word in meanings if word in BY_TOKEN]
    others = [word for word in meanings if word not in BY_TOKEN]
    if any(word not in FILLERS and not word.isdecimal() for word in others) or not roles:
        return None
    found = set(roles)
    if len(found) > 1:
        # Priority of roles: the position of the left finger is not the input, and a name with a word for time or date
        # is a time.
        for role in ("left", "right"):
            if role in found and found <= {role, "input", "gap"}:
                return role
        if found == {"time", "date"}:
            return "time"
        if found == {"input", "drive"} or ("target" in found and found <= {"target", "input"}):
            return "target"
        if "deviation" in found and found <= {"deviation", "input"}:
            return "deviation"
        return None
    return roles[0]


def mentions(name: str) -> frozenset[str]:
    """Roles of the words in a name, whatever other words the name contains.

    Examples
    --------
    >>> sorted(mentions("Vib Displacement 3f")), sorted(mentions("Feldstärke"))
    (['input'], [])
    """
    return frozenset(BY_TOKEN[_meaning(word)] for word in tokens(name) if _meaning(word) in BY_TOKEN)


def source_of(name: str) -> str | None:
    """`measured` or `simulation` if a column's name states the source of the values and nothing else; otherwise None.

    Examples
    --------
    >>> source_of("comsol"), source_of("experiment"), source_of("comsol gap")
    ('simulation', 'measured', None)
    """
    words = [word for word in tokens(name) if not word.isdigit()]
    if words and all(word in OF_SIMULATION for word in words):
        return "simulation"
    return "measured" if words and all(word in OF_MEASUREMENT for word in words) else None
