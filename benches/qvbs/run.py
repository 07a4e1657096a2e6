#!/usr/bin/env python3
"""`metaplan check` on the models of the Quantitative Verification Benchmark Set (QVBS), beside their reference values and Storm.

  run.py PROGRAM --models ../shared/real/qvbs values [--limit 60]
  run.py PROGRAM --models ../shared/real/qvbs speed --storm VENV/bin/python [--limit 60] [--from 10000]
  run.py PROGRAM --models ../shared/real/qvbs speed --reuse CSV

`values` asks every instance for all of its properties, by default and with --inexact, and compares with the reference of `index.json`: an
exact value has to be equal, bounds have to enclose it. An approximate reference is met within 0.001 of its value, as the set itself does.
`speed` runs each property of each instance alone, ours (`--inexact`) and Storm's (stormpy 2.0.0, the quickest of its sound settings), and
counts processor time from text to answer and memory; Storm's import is left out of both. A line of CSV for each row on standard output, and
a summary on standard error. Storm's side does not change with ours: `--reuse CSV` takes it from a table that was made before, and the program
`-` makes a table of Storm's side alone.
"""
import argparse, csv, json, math, os, resource, subprocess, sys, time
from fractions import Fraction
from pathlib import Path

sys.set_int_max_str_digits(0)

STORM = r"""
import json, re, resource, sys, tempfile, time
import stormpy
from stormpy import environments
from stormpy.environments import MinMaxMethod
model, constants, property_file, name, setting = sys.argv[1:]
def define(text):
    for constant in filter(None, constants.split(",")):
        left, right = constant.split("=")
        text = re.sub(r"(const\s+\w+\s+" + left + r")\s*;", r"\1 = " + right + ";", text)
    return text
properties = define(open(property_file).read())
with tempfile.NamedTemporaryFile("w", suffix=".prism") as file:
    file.write(define(open(model).read()))
    file.flush()
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    program = stormpy.parse_prism_program(file.name, prism_compatibility=True)
formulas = stormpy.parse_properties(properties, program, property_filter=[name])
environment = environments.sound()
methods = {"ovi": MinMaxMethod.OPTIMISTIC_VALUE_ITERATION, "svi": MinMaxMethod.SOUND_VALUE_ITERATION, "pi": MinMaxMethod.POLICY_ITERATION}
if setting in methods:
    environment.solver().min_max().method = methods[setting]
if setting == "dd":
    built = stormpy.build_symbolic_model(program, formulas)
else:
    built = stormpy.build_model(program, options=stormpy.BuilderOptions(formulas))
between = time.process_time()
result = stormpy.model_checking(built, formulas[0], only_initial_states=True, environment=environment)
if setting == "dd":
    result.filter(stormpy.create_filter_initial_states(built))
    value = result.get_max
    value = value() if callable(value) else value
else:
    value = result.get_value(built.initial_states[0])
end = time.process_time()
print(json.dumps({"seconds": end - start, "build": between - start, "value": float(value), "states": built.nr_states,
    "memory": (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - base) / 1024}))
"""
SETTINGS = ("sound", "ovi", "svi", "pi", "dd")


def instances(models):
    """(model, file, constants, properties file, reference values by property, states)"""
    for index in sorted(Path(models).glob('*/*/index.json')):
        benchmark = json.loads(index.read_text())
        for file in benchmark['files']:
            original = [original for original in file.get('original-file', []) if original.endswith('.prism')]
            properties = [original for original in file.get('original-file', []) if original.endswith('.props')]
            if not original:
                continue
            for values in file['open-parameter-values']:
                constants = ','.join(f"{value['name']}={str(value['value']).lower()}" for value in values['values'])
                states = next((row['number'] for row in values.get('states', []) if 'number' in row), None)
                results = {}
                for row in values.get('results', []):
                    results.setdefault(row['property'], []).append(row['value'])
                yield (benchmark['short'], index.parent / original[0], constants,
                       index.parent / (properties[0] if properties else original[0].replace('.prism', '.props')), results, states)


def run(command, limit):
    """(output or None, processor seconds, MB, exit status)"""
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (limit, limit + 1)))
    output = process.stdout.read()
    said = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = status
    process.stdout.close(), process.stderr.close()
    return output, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024, status, said.decode(errors='replace')


def ours(program, model, constants, properties, options, limit, name=None):
    command = [program, 'check', str(model), '--props', str(properties), '--format', 'json', '--quiet', *options]
    command += ['--const', constants] if constants else []
    command += ['--prop', name] if name else []
    return run(command, limit)


def verdict(answer, references):
    """agree, or how it differs"""
    for reference in references:
        if isinstance(reference, bool):
            return 'agree' if answer.get('holds') == reference else f'{answer.get("holds")} is not {reference}'
        exact = answer.get('exact')
        if isinstance(reference, dict) and 'num' in reference:
            wanted = Fraction(int(reference['num']), int(reference['den']))
            if exact is not None:
                if Fraction(exact) != wanted:
                    return f'{exact} is not {wanted}'
            elif answer['status'] != 'finite' or not Fraction(answer['lower']) <= wanted <= Fraction(answer['upper']):
                return f'[{answer.get("lower")}, {answer.get("upper")}] does not hold {float(wanted)}'
            continue
        wanted = reference.get('approx', reference.get('lower')) if isinstance(reference, dict) else reference
        if wanted in ('inf', 'infinity', '∞', math.inf):
            if answer['status'] != 'infinite':
                return f'{answer["status"]} is not infinite'
            continue
        if answer['status'] != 'finite' or abs(answer['value'] - wanted) > 1e-3 * abs(wanted) + 1e-300:
            return f'{answer.get("value")} is not {wanted}'
    return 'agree' if references else 'no reference'


def values(arguments):
    rows = csv.writer(sys.stdout)
    rows.writerow(['model', 'constants', 'states', 'mode', 'property', 'verdict', 'value', 'lower', 'upper', 'seconds'])
    counts = {}
    for short, model, constants, properties, references, states in instances(arguments.models):
        for mode in ('default', 'inexact'):
            output, seconds, _, status, said = ours(arguments.program, model, constants, properties,
                                                    ['--inexact'] if mode == 'inexact' else [], arguments.limit)
            try:
                found = json.loads(output)
            except ValueError:
                found = None
            if found is None:
                kind = 'no answer in time' if status & 0x7f else 'refused'
                for name in references or ['?']:
                    counts[mode, kind] = counts.get((mode, kind), 0) + 1
                    rows.writerow([model.name, constants, states, mode, name, kind, '', '', '', f'{seconds:.3f}'])
                if kind == 'refused':
                    print(model.name, constants, said.strip().splitlines()[:1], file=sys.stderr)
                continue
            for answer in found.get('answers', [found]):
                name = answer.get('name', '?')
                said = verdict(answer, references.get(name, []))
                kind = said if said in ('agree', 'no reference') else 'WRONG'
                counts[mode, kind] = counts.get((mode, kind), 0) + 1
                rows.writerow([model.name, constants, answer.get('statistics', {}).get('states', states), mode, name, said, answer.get('value'),
                               answer.get('lower'), answer.get('upper'), f'{seconds:.3f}'])
            for refused in found.get('refused', []):
                counts[mode, 'refused'] = counts.get((mode, 'refused'), 0) + 1
                rows.writerow([model.name, constants, states, mode, refused.get('name', '?'), f'refused: {refused}', '', '', '', ''])
            sys.stdout.flush()
    for (mode, kind), count in sorted(counts.items()):
        print(f'{mode:8} {kind:20} {count}', file=sys.stderr)


def storm_best(arguments, model, constants, properties, name):
    """What the quickest setting says of itself; a setting that takes longer than the best one so far is stopped."""
    best, limit = None, arguments.limit
    for setting in SETTINGS:
        text, _, _, _, said = run([arguments.storm, '-c', STORM, str(model), constants, str(properties), name, setting], limit)
        try:
            found = json.loads(text.splitlines()[-1]) | {'setting': setting}
        except (ValueError, IndexError):
            if arguments.verbose:
                print(model.name, name, setting, said[-300:], file=sys.stderr)
            continue
        if best is None or found['seconds'] < best['seconds']:
            best = found
            # Its start takes up to two seconds.
            limit = min(limit, math.ceil(best['seconds']) + 3)
    return best


def storm_known(path):
    """Storm's side of a table that was made before."""
    known = {}
    for row in csv.DictReader(open(path)) if path else ():
        if row['storm s']:
            known[row['model'], row['constants'], row['property']] = {
                'setting': row['storm setting'], 'seconds': float(row['storm s']), 'memory': float(row['storm MB']),
                'value': row['storm value']}
    return known


def speed(arguments):
    rows = csv.writer(sys.stdout)
    rows.writerow(['model', 'constants', 'property', 'states', 'ours s', 'ours MB', 'storm setting', 'storm s', 'storm MB', 'ratio',
                   'value', 'storm value'])
    ratios, memory, known = [], [], storm_known(arguments.reuse)
    for short, model, constants, properties, references, states in instances(arguments.models):
        if states is None or not getattr(arguments, 'from') <= states <= arguments.to:
            continue
        for name in references:
            answer, seconds, used = {}, 0.0, 0.0
            if arguments.program != '-':
                output, seconds, used, _, _ = ours(arguments.program, model, constants, properties, ['--inexact'], arguments.limit, name)
                try:
                    answer = json.loads(output)
                    answer = answer.get('answers', [answer])[0]
                except (ValueError, IndexError):
                    pass
            if arguments.reuse:
                best = known.get((model.name, constants, name))
            else:
                best = storm_best(arguments, model, constants, properties, name)
            row = [model.name, constants, name, answer.get('statistics', {}).get('states', states), f'{seconds:.3f}', f'{used:.0f}']
            if best is None:
                rows.writerow([*row, '', '', '', '', answer.get('value'), ''])
            else:
                ratio = ''
                if answer:
                    ratio = f"{best['seconds'] / seconds:.2f}"
                    ratios.append((best['seconds'] / seconds, model.name, constants, name))
                    memory.append((best['memory'] / used, model.name, constants, name))
                rows.writerow([*row, best['setting'], f"{best['seconds']:.3f}", f"{best['memory']:.0f}", ratio, answer.get('value'),
                               best['value']])
            sys.stdout.flush()
    for what, found in (('time', ratios), ('memory', memory)):
        if found:
            mean = math.exp(sum(math.log(max(ratio[0], 1e-9)) for ratio in found) / len(found))
            print(f'{what}: {len(found)} rows, geometric mean {mean:.2f}, least {min(found)}, greatest {max(found)}', file=sys.stderr)


parser = argparse.ArgumentParser()
parser.add_argument('program')
parser.add_argument('--models', required=True)
subparsers = parser.add_subparsers(dest='what', required=True)
for name in ('values', 'speed'):
    sub = subparsers.add_parser(name)
    sub.add_argument('--limit', type=int, default=60)
    if name == 'speed':
        sub.add_argument('--storm')
        sub.add_argument('--reuse')
        sub.add_argument('--from', type=int, default=10_000)
        sub.add_argument('--to', type=int, default=10_000_000)
        sub.add_argument('--verbose', action='store_true')
arguments = parser.parse_args()
if arguments.what == 'speed' and not (arguments.storm or arguments.reuse):
    parser.error('--storm PYTHON or --reuse CSV')
globals()[arguments.what](arguments)
