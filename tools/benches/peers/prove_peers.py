"""Names missing physics by the usual methods, on cases that come in on standard input.

A case is one line of JSON (rows, spans of recordings, number of base columns, groups of candidate columns with their kind) and then float64 numbers:
residual of the base model, 0/1 whether a row counts, base columns, candidate columns, one after the other. The answer is one line of JSON: for every
method the groups that it chose, with weights, the changes of the base columns' weights, and its time.
"""

import json
import sys
import time
import warnings

import numpy as np

warnings.filterwarnings("ignore")
import pysindy  # noqa: E402

MOST = 6  # effects looked for by the stepwise methods
BLOCKS = 10
AR_ORDER = 20


class Case:
    def __init__(self, header, stream):
        self.spans = header["spans"]
        rows, base, groups = header["rows"], header["base"], header["groups"]
        count = 2 + base + sum(len(g["columns"]) for g in groups)
        data = np.frombuffer(stream.read(8 * rows * count), dtype="<f8").reshape(count, rows)
        counts = data[1] > 0.5
        self.counts = counts
        self.y = np.where(counts, data[0], 0.0)
        self.base = np.where(counts, data[2 : 2 + base], 0.0).T
        self.candidates = np.where(counts, data[2 + base :], 0.0).T
        self.groups = [np.array(g["columns"]) for g in groups]
        self.kinds = [g["kind"] for g in groups]


def ar_coefficients(x, order):
    """Yule and Walker."""
    n = len(x)
    size = 1 << (2 * n - 1).bit_length()
    power = np.abs(np.fft.rfft(x - x.mean(), size)) ** 2
    r = np.fft.irfft(power, size)[: order + 1] / n
    if r[0] <= 0:
        return np.zeros(order)
    r[0] *= 1 + 1e-9
    a = np.array([r[abs(i - j)] for i in range(order) for j in range(order)]).reshape(order, order)
    return np.linalg.solve(a, r[1:])


def whiten(case, residual, *blocks):
    """Every block filtered by the autoregression of the residual, recording by recording."""
    out = [b.copy() for b in blocks]
    for start, end in case.spans:
        phi = ar_coefficients(residual[start:end], AR_ORDER)
        for source, target in zip(blocks, out):
            for lag, a in enumerate(phi, 1):
                target[start + lag : end] -= a * source[start : end - lag]
            target[start : start + AR_ORDER] = 0.0
    return out


def projected(base, *blocks):
    """What base columns cannot follow."""
    scale = np.sqrt((base**2).sum(0)) + 1e-300
    q, r = np.linalg.qr(base / scale)
    q = q[:, np.abs(np.diag(r)) > 1e-9]
    return [b - q @ (q.T @ b) for b in blocks]


def fit(columns, y):
    scale = np.sqrt((columns**2).sum(0)) + 1e-300
    return np.linalg.lstsq(columns / scale, y, rcond=1e-9)[0] / scale


def gains(case, candidates, y, taken):
    """The sum of squares that each group would take, beside those taken."""
    found = []
    for k, group in enumerate(case.groups):
        own = candidates[:, group]
        if case.kinds[k] in taken:
            found.append(0.0)
            continue
        scale = np.sqrt((own**2).sum(0)) + 1e-300
        own = own / scale
        gram = own.T @ own
        b = own.T @ y
        found.append(float(b @ np.linalg.lstsq(gram, b, rcond=1e-9)[0]))
    return np.array(found)


def forward(case, base, candidates, y, worth):
    """Groups by their gain, while `worth` says so; a kind enters once."""
    n = int(case.counts.sum())
    chosen = []
    y, candidates = projected(base, y, candidates)
    size = np.sqrt((candidates**2).sum(0))
    while len(chosen) < MOST:
        gain = gains(case, candidates, y, [case.kinds[c] for c in chosen])
        penalised = [worth(n, y @ y, g, len(case.groups[k])) for k, g in enumerate(gain)]
        best = int(np.argmax(penalised))
        if penalised[best] <= 0:
            break
        chosen.append(best)
        own = candidates[:, case.groups[best]]
        y, candidates = projected(own, y, candidates)
        # Columns that are spanned already are noise of the arithmetic.
        spanned = np.sqrt((candidates**2).sum(0)) < 1e-7 * size
        candidates[:, spanned] = 0.0
    return chosen


def bic(n, rss, gain, parameters):
    return -n * np.log1p(-min(gain / rss, 1 - 1e-12)) - parameters * np.log(n)


def forward_bic(case):
    return forward(case, case.base, case.candidates, case.y, bic)


def group_ebic(case):
    """AR(20) of the residual, then forward by the extended criterion over groups (Chen, Chen 2008); the noise anew after every step."""
    count = len(set(case.kinds))

    def ebic(n, rss, gain, parameters):
        return bic(n, rss, gain, parameters) - 2 * np.log(count)

    chosen = []
    while len(chosen) < MOST:
        known = np.hstack([case.base] + [case.candidates[:, case.groups[c]] for c in chosen])
        residual = case.y - known @ fit(known, case.y)
        base, candidates, y = whiten(case, residual, known, case.candidates, case.y)
        for k, kind in enumerate(case.kinds):
            if kind in [case.kinds[c] for c in chosen]:
                candidates[:, case.groups[k]] = 0.0
        more = [c for c in forward(case, base, candidates, y, ebic)[:1]]
        if not more:
            break
        chosen += more
    return chosen


def block_cross_validation(case):
    """Forward by the error of blocks, each predicted from the others; a step has to gain more than its standard error."""
    columns = np.hstack([case.base, case.candidates, case.y[:, None]])
    scale = np.sqrt((columns**2).sum(0)) + 1e-300
    columns = columns / scale
    edges = np.linspace(0, len(case.y), BLOCKS + 1).astype(int)
    grams = np.array([columns[a:b].T @ columns[a:b] for a, b in zip(edges, edges[1:])])
    total = grams.sum(0)
    base = np.arange(case.base.shape[1])
    last = columns.shape[1] - 1

    def errors(index):
        out = np.empty(BLOCKS)
        for k, gram in enumerate(grams):
            rest = total - gram
            a = rest[np.ix_(index, index)]
            w = np.linalg.lstsq(a, rest[index, last], rcond=1e-10)[0]
            out[k] = gram[last, last] - 2 * w @ gram[index, last] + w @ gram[np.ix_(index, index)] @ w
        return out

    chosen, index = [], base
    best = errors(index)
    while len(chosen) < MOST:
        y, candidates = projected(columns[:, index], columns[:, last], columns[:, len(base) : last])
        gain = gains(case, candidates, y, [case.kinds[c] for c in chosen])
        step = None
        for k in np.argsort(gain)[::-1][:30]:
            if gain[k] <= 0:
                continue
            tried = np.concatenate([index, len(base) + case.groups[k]])
            e = errors(tried)
            if step is None or e.sum() < step[1].sum():
                step = (int(k), e, tried)
        if step is None:
            break
        gained = best - step[1]
        if gained.mean() <= gained.std(ddof=1) / np.sqrt(BLOCKS):
            break
        chosen.append(step[0])
        best, index = step[1], step[2]
    return chosen


class Sparse:
    """The best shape of each kind alone, scaled to unit rms, the base taken out of all."""

    def __init__(self, case):
        y, candidates = projected(case.base[case.counts], case.y[case.counts], case.candidates[case.counts])
        size = np.sqrt((case.candidates**2).mean(0)) + 1e-300
        gain = gains(case, candidates, y, [])
        kinds = sorted(set(case.kinds))
        self.groups = case.groups
        self.best = [max((k for k in range(len(gain)) if case.kinds[k] == kind), key=lambda k: gain[k]) for kind in kinds]
        columns = np.concatenate([case.groups[k] for k in self.best])
        left = np.sqrt((candidates[:, columns] ** 2).mean(0))
        seen = left > 1e-6 * size[columns]
        self.columns = columns[seen]
        self.x = candidates[:, self.columns] / left[seen]
        self.y = (y / y.std())[:, None]

    def coefficients(self, optimizer, rows=slice(None)):
        optimizer.fit(self.x[rows], self.y[rows])
        return np.asarray(optimizer.coef_).ravel()

    def chosen(self, coefficients):
        active = set(self.columns[np.abs(coefficients) > 0])
        return [k for k in self.best if active & set(self.groups[k])]


def stlsq(case):
    """The threshold by held-out blocks; nothing where no threshold predicts better than nothing."""
    sparse = Sparse(case)
    blocks = np.array_split(np.arange(len(sparse.y)), 5)

    def error(threshold):
        total = 0.0
        for block in blocks:
            rest = np.setdiff1d(np.arange(len(sparse.y)), block)
            w = sparse.coefficients(pysindy.STLSQ(threshold=threshold), rest)
            total += ((sparse.y[block, 0] - sparse.x[block] @ w) ** 2).sum()
        return total

    errors = {threshold: error(threshold) for threshold in (0.02, 0.05, 0.1, 0.2, 0.5)}
    best = min(errors, key=errors.get)
    if errors[best] >= (sparse.y**2).sum():
        return []
    return sparse.chosen(sparse.coefficients(pysindy.STLSQ(threshold=best)))


def ensemble(case):
    np.random.seed(1)
    sparse = Sparse(case)
    return sparse.chosen(sparse.coefficients(pysindy.EnsembleOptimizer(pysindy.STLSQ(), bagging=True)))


METHODS = {
    "STLSQ": stlsq,
    "E-SINDy": ensemble,
    "forward BIC": forward_bic,
    "block CV": block_cross_validation,
    "AR EBIC": group_ebic,
}


def main():
    stream = sys.stdin.buffer
    for line in iter(stream.readline, b""):
        case = Case(json.loads(line), stream)
        answers = []
        for name, method in METHODS.items():
            clock = time.perf_counter()
            chosen = method(case)
            columns = np.hstack([case.base] + [case.candidates[:, case.groups[c]] for c in chosen])
            # Names by each method's own rule; weights by generalised least squares for all.
            residual = case.y - columns @ fit(columns, case.y)
            x, y = whiten(case, residual, columns, case.y)
            weights = fit(x, y)
            seconds = time.perf_counter() - clock
            groups, at = [], case.base.shape[1]
            for c in chosen:
                size = len(case.groups[c])
                groups.append({"group": int(c), "weights": weights[at : at + size].tolist()})
                at += size
            base = weights[: case.base.shape[1]].tolist()
            answers.append({"method": name, "groups": groups, "base": base, "seconds": seconds})
        print(json.dumps(answers), flush=True)


if __name__ == "__main__":
    main()
