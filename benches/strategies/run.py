#!/usr/bin/env python3
"""Measures the strategies of the SAT solver alone: no quick search, one thread, processor time.

Five families: UGV and UUV missions with a numeric battery (gen_ratpa.py), missions on Cámara's map with a battery that binds
(gen_camara.py), deliveries by several robots, and errands of one robot that pays for every design it changes (both generated here).
Each run is a process of its own. Results as CSV, a line for each run, and a table on standard error. Needs Python alone.

  run.py PROGRAM --shared ../shared --strategies tighten,cores --solvers varisat,batsat --limit 60 > results.csv

PROGRAM is `target/release/examples/formulas` (cargo build --release -p metaplan-planner --example formulas).
"""
import argparse, collections, csv, math, os, random, resource, subprocess, sys, tempfile

UGV = [(n, m, k) for n in (10, 20, 50, 100) for m in (3, 6) for k in (1, 2)]
UUV = [(n, m, k) for n in (2, 3) for m in (3, 6) for k in (1, 2)]
DELIVERIES = [(1, 3, 3), (2, 3, 3), (2, 4, 3), (2, 4, 4), (3, 4, 4), (2, 5, 4), (3, 5, 4), (3, 6, 5)]
ERRANDS = [(6, 2, 3), (8, 2, 4), (10, 3, 4), (12, 3, 4), (14, 3, 5), (16, 4, 5)]


def ratpa(shared, folder):
    for family, sizes in (('ugv', UGV), ('uuv', UUV)):
        for n, m, k in sizes:
            name = f'{family}-{n}-{m}-{k}'
            command = [sys.executable, f'{shared}/tools/gen_ratpa.py', '--family', family, '--n', n, '--m', m, '--k', k,
                       '--seed', 5, '--metric', 'weighted', '--enc', 'n', '--out', folder, '--name', name]
            if family == 'ugv':
                command += ['--goals', 1 + k, '--reconf', 3 if k == 2 else 0]
            subprocess.run([str(part) for part in command], check=True, stdout=subprocess.DEVNULL)
            yield family, name


def camara(shared, folder):
    with open(f'{shared}/reference/camara_pairs.csv') as file:
        rows = [row for row in csv.DictReader(file) if row['optimal_time_ms'] and not row['fail']]
    for index, row in enumerate(rows[:: max(1, len(rows) // 7)][:7]):
        name = f'camara-{index}'
        own = os.path.join(folder, name)
        command = [sys.executable, f'{shared}/tools/gen_camara.py', f'{shared}/reference/p2cp3_summary.json', '--start',
                   row['start'], '--goal', row['goal'], '--battery', row['battery_mj'], '--no-oracle', '--out', own]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        for file in os.listdir(own):
            part = 'domain' if 'domain' in file else 'problem'
            os.rename(os.path.join(own, file), os.path.join(folder, f'{name}.n.{part}.pddl'))
        yield 'camara', name


def deliveries(robots, parcels, places, seed=1):
    """Robots that carry parcels between places, each way with the design that suits it."""
    choose = random.Random(seed * 1000 + robots * 100 + parcels * 10 + places)
    domain = '''(define (domain deliveries) (:requirements :typing :action-costs)
  (:types robot parcel place design function)
  (:predicates (at ?r - robot ?p - place) (lies ?o - parcel ?p - place) (holds ?r - robot ?o - parcel) (free ?r - robot)
    (way ?a ?b - place) (solves ?d - design ?f - function) (suits ?d - design ?a ?b - place))
  (:functions (total-cost) (price ?d - design) (length ?a ?b - place))
  (:action move :parameters (?r - robot ?a ?b - place ?f - function ?d - design)
    :precondition (and (at ?r ?a) (way ?a ?b) (solves ?d ?f) (suits ?d ?a ?b))
    :effect (and (not (at ?r ?a)) (at ?r ?b) (increase (total-cost) (* (length ?a ?b) (price ?d)))))
  (:action pick :parameters (?r - robot ?o - parcel ?p - place)
    :precondition (and (at ?r ?p) (lies ?o ?p) (free ?r))
    :effect (and (not (lies ?o ?p)) (not (free ?r)) (holds ?r ?o) (increase (total-cost) 1)))
  (:action drop :parameters (?r - robot ?o - parcel ?p - place)
    :precondition (and (at ?r ?p) (holds ?r ?o))
    :effect (and (lies ?o ?p) (free ?r) (not (holds ?r ?o)) (increase (total-cost) 1))))'''
    names = [f'p{i}' for i in range(places)]
    init = ['(= (total-cost) 0)'] + [f'(solves d{i} f) (= (price d{i}) {1 + i})' for i in range(3)]
    for i, a in enumerate(names):
        for b in (names[(i + 1) % places], names[(i - 1) % places]):
            init.append(f'(way {a} {b}) (= (length {a} {b}) {choose.randint(1, 3)})')
            init += [f'(suits d{d} {a} {b})' for d in range(3) if d == 2 or choose.random() < 0.6]
    goal = []
    for i in range(robots):
        init.append(f'(at r{i} {choose.choice(names)}) (free r{i})')
    for i in range(parcels):
        start, end = choose.sample(names, 2)
        init.append(f'(lies o{i} {start})')
        goal.append(f'(lies o{i} {end})')
    objects = (f'{" ".join(f"r{i}" for i in range(robots))} - robot {" ".join(f"o{i}" for i in range(parcels))} - parcel '
               f'{" ".join(names)} - place d0 d1 d2 - design f - function')
    return domain, (f'(define (problem p) (:domain deliveries) (:objects {objects}) (:init {" ".join(init)}) '
                    f'(:goal (and {" ".join(goal)})) (:metric minimize (total-cost)))')


def errands(places, stops, designs, seed=1):
    """One robot that has to see some places; changing its design costs more than a short way."""
    choose = random.Random(seed * 1000 + places * 10 + stops)
    domain = '''(define (domain errands) (:requirements :typing :action-costs)
  (:types place design)
  (:predicates (at ?p - place) (seen ?p - place) (way ?a ?b - place) (uses ?d - design) (suits ?d - design ?a ?b - place))
  (:functions (total-cost) (price ?d - design ?a ?b - place) (change ?d ?e - design))
  (:action move :parameters (?a ?b - place ?d - design)
    :precondition (and (at ?a) (way ?a ?b) (uses ?d) (suits ?d ?a ?b))
    :effect (and (not (at ?a)) (at ?b) (seen ?b) (increase (total-cost) (price ?d ?a ?b))))
  (:action change :parameters (?d ?e - design)
    :precondition (uses ?d)
    :effect (and (not (uses ?d)) (uses ?e) (increase (total-cost) (change ?d ?e)))))'''
    names = [f'p{i}' for i in range(places)]
    init = ['(= (total-cost) 0)', '(at p0)', '(uses d0)']
    for i, a in enumerate(names):
        for j in {(i + 1) % places, (i + 2) % places, (i - 1) % places, choose.randrange(places)} - {i}:
            b = names[j]
            init.append(f'(way {a} {b})')
            for d in range(designs):
                if choose.random() < 0.7:
                    init.append(f'(suits d{d} {a} {b}) (= (price d{d} {a} {b}) {choose.randint(2, 30)})')
    init += [f'(= (change d{d} d{e}) {choose.randint(3, 25)})' for d in range(designs) for e in range(designs) if d != e]
    goal = [f'(seen {p})' for p in choose.sample(names[1:], stops)]
    objects = f'{" ".join(names)} - place {" ".join(f"d{d}" for d in range(designs))} - design'
    return domain, (f'(define (problem p) (:domain errands) (:objects {objects}) (:init {" ".join(init)}) '
                    f'(:goal (and {" ".join(goal)})) (:metric minimize (total-cost)))')


def generated(folder):
    for family, sizes, make in (('deliveries', DELIVERIES, deliveries), ('errands', ERRANDS, errands)):
        for size in sizes:
            name = f'{family}-{"-".join(str(part) for part in size)}'
            for part, text in zip(('domain', 'problem'), make(*size)):
                with open(os.path.join(folder, f'{name}.n.{part}.pddl'), 'w') as file:
                    file.write(text)
            yield family, name


def run(program, folder, name, solver, strategy, limit):
    """What the program says, and its processor time; none if it needs more than the limit."""
    files = [os.path.join(folder, f'{name}.n.{part}.pddl') for part in ('domain', 'problem')]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, *files, solver, strategy, '100000'], capture_output=True, text=True,
                          preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit)))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = done.stdout.split() if done.returncode == 0 else ['none', '-', '-', '-', '-', '-', '-']
    return words, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def table(rows, limit):
    """Solved, and the geometric mean of times over instances that some strategy solves; the limit where one does not."""
    by = collections.defaultdict(dict)
    for row in rows:
        by[row['solver'], row['family'], row['name']][row['strategy']] = row
    strategies = list(dict.fromkeys(row['strategy'] for row in rows))
    for group in dict.fromkeys((row['solver'], row['family']) for row in rows):
        some = [runs for key, runs in by.items() if key[:2] == group and any(r['status'] == 'Optimal' for r in runs.values())]
        line = f'{group[0]:8} {group[1]:11} {len(some):3}'
        for strategy in strategies:
            runs = [runs[strategy] for runs in some if strategy in runs]
            times = [row['seconds'] if row['status'] == 'Optimal' else limit for row in runs]
            mean = math.exp(sum(math.log(max(t, 0.001)) for t in times) / len(times)) if times else math.nan
            line += f'   {strategy}: {sum(row["status"] == "Optimal" for row in runs)} in {mean:.2f} s'
        print(line, file=sys.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('program')
    parser.add_argument('--shared', default='../shared')
    parser.add_argument('--strategies', default='tighten,cores')
    parser.add_argument('--solvers', default='varisat,batsat')
    parser.add_argument('--limit', type=int, default=60, help='seconds of processor time for each run')
    arguments = parser.parse_args()
    rows = []
    writer = csv.writer(sys.stdout)
    writer.writerow('family name solver strategy status cost bound steps calls conflicts seconds'.split())
    with tempfile.TemporaryDirectory() as folder:
        for make in (generated(folder), ratpa(arguments.shared, folder), camara(arguments.shared, folder)):
            for family, name in make:
                for solver in arguments.solvers.split(','):
                    for strategy in arguments.strategies.split(','):
                        words, seconds = run(arguments.program, folder, name, solver, strategy, arguments.limit)
                        writer.writerow([family, name, solver, strategy, *words[:6], f'{seconds:.3f}'])
                        sys.stdout.flush()
                        rows.append({'family': family, 'name': name, 'solver': solver, 'strategy': strategy,
                                     'status': words[0], 'seconds': seconds})
    table(rows, arguments.limit)


if __name__ == '__main__':
    main()
