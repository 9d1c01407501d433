"""Invalid specs: `validate` refuses each with a code, a key, its place and a hint.

A row of a table has code and key, and the changes of the spec at its head, separated by bars. Indented lines
continue the row before. Words in capitals are abbreviations from NAMES.
"""

import re

import pytest

from inputdesign_cli import load_spec, parse_spec, validate
from tests.questions.test_durations_and_channels import HEATER
from tests.questions.test_loop_error_parameters import REST as LOOP_ERROR
from tests.questions.test_loop_margins import TEXT as MARGINS
from tests.questions.test_matrix_designs import LOOP as MATRIX_LOOP
from tests.questions.test_plants_in_words import REST, WORDS
from tests.questions.test_response import SINGLE as RESPONSE
from tests.questions.test_sampled_loops import ONE, TWO, WORDED as CONTROLLED
from tests.questions.test_sensitivity import SPEC as SENSITIVITY
from tests.questions.test_vanishing_coefficients import REST as VANISHING
from tests.support.campaigns import SPEC as CAMPAIGN
from tests.support.first_order_specs import ERROR, FIR, PLANT
from tests.support.matrix_specs import CONTINUOUS
from tests.support.refusals import refusals
from tests.support.robust_specs import COVARIANCE, FIRST, LOOP, PROCESS

HELD = f"plant: {WORDS['in s and in q'][0]}\n{REST}"
ONE_INPUT = PLANT + ERROR + FIR

TABLES = {
    "first order": (ONE_INPUT, """
unknown-parameter accuracy.standard_deviation | accuracy={standard_deviation: {b7: 1}}
unknown-parameter accuracy.application | accuracy={application: {parameters: [b1, x], hessian: [[1, 0], [0,
  1]], gamma: 1}}
wrong-shape accuracy.information | accuracy={information: [[1, 0], [0, 1]]}
bad-limit limits.band | limits={band: [0, 1]}
bad-limit limits.spectrum | spectrum={type: free} | limits={spectrum: 3}
too-few-lines spectrum.lines | spectrum={type: multisine, lines: 3} | limits={band: [0.1, 0.2]}
bad-limit limits.spectrum | limits={spectrum: {max: 1, min: {numerator: [1.5]}}}
not-sampled accuracy.weighted_variance.weight | accuracy={weighted_variance: {weight: {continuous: {numerator:
  [1], denominator: [1, 1]}}, max: 1}}
unknown-word accuracy.weighted_variance.relative | accuracy={weighted_variance: {max: 1, relative: perhaps}}
not-supported solver.method | solver={method: lmi} | limits={input_power: 1}
conflicting-keys signal.hold | signal={hold: 7}
unsuitable-key signal.ramp | signal={ramp: 10, bits: 5}
out-of-range signal.ramp | signal={ramp: 251}
out-of-range signal.lines | signal={lines: [1, 251]}
conflicting-keys signal.amplitudes | limits={amplitude: 1} | signal={amplitudes: 2}
coarse-converter limits.rate | limits={rate: 0.1} | signal={quantisation: {bits: 4, range: 5}}
coarse-converter signal.offset | signal={offset: 9, quantisation: {bits: 4, range: 5}}
no-sample-rate signal.also | sample_time=0.3 | signal={also: [wav]}
no-sample-rate signal.also | sample_time=1.0e-10 | signal={also: [wav]}
not-supported signal.order | signal={order: 3}
unsuitable-key signal.type | signal={type: slewed}
unknown-word signal.lines | signal={lines: even}
not-increasing signal.lines | signal={lines: [3, 2]}
missing-key signal.quantisation.range | signal={quantisation: {bits: 8}}
unknown-word signal.also[0] | signal={also: [ogg]}
unknown-word signal.scale | signal={scale: full}
missing-key limits.amplitude | limits={amplitude: {}}
wrong-shape limits.amplitude.output | limits={amplitude: {output: [1, 2]}}
out-of-range limits.amplitude | limits={amplitude: -1}
unstable-loop experiment.controller | experiment.controller={numerator: [-2], denominator: [1]}
admissible-not-positive accuracy.model_error | plant.B=[0, 1, 1]
not-identifiable plant | plant={B: [0, 1, -0.7], F: [1, -0.7]}
"""),
    "held": (HELD, """
unstable-polynomial noise.D | noise={D: [1, -1], variance: 1}
unstable-polynomial noise.D | noise={D: [1, -1.1], known: [d1], variance: 1}
wrong-shape noise.drift | noise={drift: [true, false], variance: 1}
unknown-word noise.drift | noise={drift: 3, variance: 1}
unknown-name plant.continuous.numerator[0] | plant={parameters: {K: 1, T: 2}, continuous: {numerator: [Kp],
  denominator: [T, 1]}, sample: zoh}
unused-parameter plant.parameters.T | plant={parameters: {K: 1, T: 2}, continuous: {numerator: [K],
  denominator: [3, 1]}, sample: zoh}
unused-parameter plant.parameters | plant={parameters: {K: 1, z: 0}, continuous: {numerator: [K*(1 + z**2)],
  denominator: [3, 1]}, sample: zoh}
undefined-expression plant.continuous.numerator[0] | plant={parameters: {K: 0}, continuous: {numerator: [1/K],
  denominator: [3, 1]}, sample: zoh}
bad-expression plant.continuous.numerator[0] | plant={parameters: {K: 1}, continuous: {numerator: ['K^2'],
  denominator: [3, 1]}, sample: zoh}
bad-name plant.parameters.exp | plant={parameters: {exp: 1}, continuous: {numerator: [exp], denominator: [3,
  1]}, sample: zoh}
out-of-range plant.continuous.delay | plant={parameters: {L: -1}, continuous: {numerator: [1], denominator:
  [3, 1], delay: L}, sample: zoh}
delay-beyond-record plant.continuous.dead_time | plant={continuous: {gain: 1, time_constant: 1, dead_time:
  151}, sample: zoh}
wrong-shape plant.continuous.time_constant | plant={continuous: {gain: 1, time_constant: [[1, 2]]}, sample:
  zoh}
conflicting-keys plant.continuous.damping | plant={continuous: {gain: 1, time_constant: 1, damping: 0.1,
  natural_frequency: 1}, sample: zoh}
missing-key plant.continuous | plant={continuous: {gain: 1, damping: 0.1}, sample: zoh}
unknown-parameter plant.known | plant={continuous: {gain: 1, time_constant: 1}, known: [K], sample: zoh}
not-a-number plant.state_space.A[0][0] | plant={state_space: {A: [[a]], B: [[1]], C: [[1]]}}
missing-key plant | plant={state_space: {A: [[-1]], B: [[1]], C: [[1]]}, sample: zoh}
missing-key plant | plant={parameters: {a: -1}, state_space: {A: [[a]], B: [[1]], C: [[1]]}}
unsuitable-key plant.sample | plant={parameters: {a: 0.5}, state_space: {A: [[a]], B: [[1]], C: [[1]], time:
  discrete}, sample: zoh}
unsuitable-key plant.state_space.delay | plant={parameters: {a: 0.5}, state_space: {A: [[a]], B: [[1]], C:
  [[1]], time: discrete, delay: 1}}
unsuitable-key plant.state_space.delay | plant={parameters: {a: 0.5, L: 0}, state_space: {A: [[a]], B: [[1]],
  C: [[1]], time: discrete, delay: L}}
wrong-shape plant.state_space.A | plant={parameters: {a: -1}, state_space: {A: [[a, 0]], B: [[1]], C: [[1]]},
  sample: zoh}
wrong-shape plant.state_space.B | plant={parameters: {a: -1}, state_space: {A: [[a]], B: [[1], [2]], C:
  [[1]]}, sample: zoh}
unstable-polynomial plant.state_space.A | plant={parameters: {a: 1}, state_space: {A: [[a]], B: [[1]], C:
  [[1]]}, sample: zoh}
delay-beyond-record plant.state_space.delay | plant={parameters: {a: -1}, state_space: {A: [[a]], B: [[1]], C:
  [[1]], delay: 400}, sample: zoh}
unknown-word plant.state_space.time | plant={parameters: {a: -1}, state_space: {A: [[a]], B: [[1]], C: [[1]],
  time: digital}, sample: zoh}
unused-parameter plant.parameters.b | plant={parameters: {a: -1, b: 2}, state_space: {A: [[a]], B: [[1]], C:
  [[1]]}, sample: zoh}
conflicting-keys plant.state_space.K | plant={parameters: {a: 0.5}, state_space: {A: [[a]], B: [[1]], C:
  [[1]], K: [[0.1]], time: discrete}} | noise={C: [1, 0.2], variance: 0.1}
bad-name plant.parameters.c1 | plant={parameters: {c1: 2.1, T: 18}, continuous: {gain: c1, time_constant: T},
  sample: zoh} | noise={C: [1, 0.5], variance: 0.04}
bad-name plant.parameters.d1 | plant={parameters: {d1: 2.1, T: 18}, continuous: {gain: d1, time_constant: T},
  sample: zoh} | noise={D: [1, -0.3], variance: 0.04}
"""),
    "controlled": (CONTROLLED, """
out-of-range experiment.controller.pid.Kp | UNDER {pid: {Kp: 0}}} | plant=ONE
out-of-range experiment.controller.pid.Ti | UNDER {pid: {Kp: 1, Ti: 0}}} | plant=ONE
improper-transfer experiment.controller.pid.Tf | UNDER {pid: {Kp: 1, Td: 1, Tf: 0}}} | plant=ONE
unknown-key experiment.controller.pid.Ki | UNDER {pid: {Kp: 1, Ki: 3}}} | plant=ONE
out-of-range experiment.controller.delay | UNDER {pid: {Kp: 1}, delay: -1}} | plant=ONE
missing-key experiment.controller.sample | UNDER {continuous: {numerator: [1], denominator: [1, 0]}}} |
  plant=ONE
improper-transfer experiment.controller.continuous.numerator | UNDER {continuous: {numerator: [1, 0],
  denominator: [1]}, sample: zoh}} | plant=ONE
wrong-shape experiment.controller | UNDER {pid: {Kp: 1}}} | plant=TWO
wrong-shape experiment.controller.loops[0].output | UNDER {loops: [{output: 3, input: 1, controller: {pid:
  {Kp: 1}}}]}} | plant=TWO
conflicting-keys experiment.controller.loops[1] | UNDER {loops: [{output: 1, input: 1, controller: {pid: {Kp:
  1}}}, {output: 1, input: 1, controller: {pid: {Kp: 2}}}]}} | plant=TWO
"""),
    "vanishing": (VANISHING, """
improper-transfer plant.continuous.numerator | plant={sample: zoh, parameters: {q: 0, T: 5}, continuous:
  {numerator: [q, 1, 1], denominator: [T, 1]}}
without-effect plant | plant={sample: zoh, parameters: {K: 0, T: 5}, continuous: {gain: K, time_constant: T}}
zero-polynomial plant.continuous.gain | plant={sample: zoh, parameters: {T: 5}, continuous: {gain: 0,
  time_constant: T}}
zero-polynomial plant.continuous.numerator | plant={sample: zoh, parameters: {T: 5}, continuous: {numerator:
  [2-2], denominator: [T, 1]}}
zero-polynomial plant.B | plant={parameters: {f: 0.5}, B: [0, 0], F: [1, -f]}
"""),
    "continuous": (CONTINUOUS, """
improper-transfer plant.continuous.numerator[0][0] | plant.continuous.numerator=[[[1, 0, 0, 3.1], [3.2]],
  [[5.3], [1.6]]]
unstable-polynomial plant.continuous.denominator[0][0] | plant.continuous.denominator=[[[1, -1.5, 1.6], [1, 2,
  1.1]], [[1, 0.5, 1.1], [1, 1, 0.3]]]
bad-band spectrum.band | spectrum.band=[2, 2]
needs-band spectrum | spectrum={type: free}
beyond-nyquist sample_time | sample_time=4
bad-limit spectrum.band | limits.band=[0, 1]
unsuitable-key accuracy.model_error.sensitivity.controller | accuracy={model_error: {sensitivity: {max_db: 6,
  controller: {numerator: [0.1]}}}}
not-supported signal.hold | signal.hold=2
not-supported spectrum.factor_columns | accuracy={standard_deviation: {'b0[1,1]': 0.1}} |
  spectrum.factor_columns=1
"""),
    "matrix loop": (MATRIX_LOOP, """
wrong-shape experiment.controller.numerator | experiment.controller.numerator=[[[0.3], [0]]]
"""),
    "sensitivity": (SENSITIVITY, """
conflicting-keys accuracy.model_error.norm | accuracy.model_error.norm=entry
not-supported accuracy.model_error.region | accuracy.model_error.region=ellipsoid
wrong-shape accuracy.model_error.sensitivity.controller | accuracy.model_error.sensitivity={max_db: 6,
  controller: {numerator: [1]}}
"""),
    "margins": (MARGINS, """
admissible-not-positive accuracy.loop | accuracy.loop.max_sensitivity_db=3
needs-controller accuracy.loop | accuracy={loop: {max_sensitivity_db: 6}}
missing-key accuracy.loop | accuracy={loop: {tuning: {simc: {}}}}
out-of-range accuracy.loop.max_sensitivity_db | accuracy.loop.max_sensitivity_db=100.1
conflicting-keys accuracy.loop.gain_margin | accuracy.loop.gain_margin=2
out-of-range accuracy.loop.gain_margin | accuracy={loop: {gain_margin: 1, tuning: {simc: {}}}}
out-of-range accuracy.loop.phase_margin | accuracy={loop: {phase_margin: 60, tuning: {simc: {}}}}
conflicting-keys accuracy.loop | accuracy.model_error={relative: 0.1}
not-supported accuracy.loop.tuning | plant={B: [0, 1], F: [1, -0.5]}
not-supported accuracy.loop.tuning | plant={continuous: {gain: 2, damping: 0.5, natural_frequency: 0.1},
  sample: zoh}
"""),
    "heater": (HEATER, """
conflicting-keys experiment.duration | experiment={duration: 3600, samples: 700}
out-of-range experiment.duration | experiment={duration: 3}
not-a-number experiment.duration | experiment={duration: long}
out-of-range limits.duration | limits={duration: 1}
unknown-name channels.u2 | channels={u2: {unit: V}}
not-a-text channels.u1.unit | channels={u1: {unit: 3}}
bad-name channels.u1.unit | channels={u1: {unit: 'a, b'}}
"""),
    "uncertain": (FIRST, """
unknown-parameter uncertainty.scenarios[1] | uncertainty={scenarios: [{f1: -0.6}, {a1: 0.3}]}
no-stable-plant uncertainty.scenarios[0] | uncertainty={scenarios: [{f1: -1.0}]}
no-stable-plant uncertainty.scenarios[0] | uncertainty={scenarios: [{c1: 1.0}]}
not-a-plant uncertainty.scenarios[1] | uncertainty={scenarios: [{b1: 3}, {b1: 0}]}
not-identifiable uncertainty | plant.B=[0, 3.6, 0.4] | uncertainty={scenarios: [{b1: 1, b2: -0.7}]}
not-identifiable uncertainty | plant.B=[0, 3.6, 0.4] | GIVEN_ONE | signal=null |
  uncertainty={scenarios: [{b1: 1, b2: -0.7}]}
wrong-shape uncertainty.covariance | uncertainty={covariance: [[1, 0], [0, 1]]}
unknown-parameter uncertainty.covariance | uncertainty={covariance: [[1, 0], [0, 1]], parameters: [b1, b9]}
not-positive-definite uncertainty.information | uncertainty={information: [[1, 0, 0], [0, 0, 0], [0, 0, 1]]}
missing-key uncertainty | uncertainty={seed: 3}
conflicting-keys uncertainty.intervals | uncertainty={covariance: COVARIANCE, intervals: {b1: [1, 5]}}
conflicting-keys uncertainty.covariance | uncertainty={covariance: COVARIANCE, scenarios: [{b1: 3}]}
conflicting-keys uncertainty.risk | uncertainty={scenarios: [{b1: 3}], risk: 0.1}
not-positive-definite uncertainty.covariance | uncertainty={covariance: [[1, 2], [2, 1]]}
not-positive-definite uncertainty.covariance | uncertainty={covariance: [[1, 1], [1, 1]]}
not-a-number uncertainty.scenarios[0].F | uncertainty={scenarios: [{F: [1, -0.5, 0.2]}]}
bad-interval uncertainty.intervals.b1 | uncertainty={intervals: {b1: [4, 3]}}
too-large uncertainty.scenarios | uncertainty={covariance: COVARIANCE, scenarios: 5000}
out-of-range uncertainty.discard | uncertainty={covariance: COVARIANCE, discard: 0.7}
conflicting-keys uncertainty.discard | uncertainty={covariance: COVARIANCE, discard: 0.1, risk: 0.1}
not-supported uncertainty | uncertainty={scenarios: [{b1: 3}]} | solver.method=lmi
not-supported uncertainty | uncertainty={scenarios: [{b1: 3}]} | accuracy={criterion: D} |
  limits={input_power: 1} | spectrum={type: polynomial, order: 4, band: [0, 3], factor_columns: 1}
not-supported uncertainty | uncertainty={scenarios: [{b1: 3}]} | accuracy={model_error: {relative: 0.1,
  region: ellipsoid}} | uncertainty.r_adm=fixed
not-supported uncertainty | uncertainty={scenarios: [{b1: 3}]} | accuracy={model_error: {relative: 0.1,
  confidence: {exact: 0.95}}}
not-supported uncertainty | GIVEN_ONE | accuracy={criterion: D} | signal=null
not-supported uncertainty | GIVEN_ONE | accuracy=null | signal=null
not-supported limits | GIVEN_ONE | limits={amplitude: {output: 9}} | signal=null
not-supported uncertainty.cost | GIVEN_ONE | uncertainty.cost=worst | signal=null
not-supported uncertainty | GIVEN_ONE | accuracy={model_error: {relative: 0.1, confidence: {exact: 0.95}}} |
  signal=null
conflicting-keys uncertainty.worst_case | uncertainty={scenarios: [{f1: -0.5}], worst_case: 0.9}
conflicting-keys uncertainty.discard | uncertainty={covariance: COVARIANCE, discard: 0.1, worst_case: 0.9}
conflicting-keys experiment.prior.parameters | experiment.prior={information: earlier.csv, parameters: [b1]}
conflicting-keys experiment.prior.parameters | experiment.prior={information: model.yaml, parameters: {b1:
  3.6}}
"""),
    "uncertain loop": (LOOP, """
bad-interval uncertainty.intervals.b1 | uncertainty={intervals: {b1: [-90, -30], f1: [-0.9, -0.7]}}
no-stable-plant uncertainty | uncertainty={covariance: [[1.0e+4, 0], [0, 1]], scenarios: 25}
no-stable-plant uncertainty.stable_within | uncertainty={covariance: [[1, 0], [0, 1]], stable_within: 0.5}
not-supported limits | GIVEN_ONE | limits={input_power: 9} | signal=null
"""),
    "uncertain process": (PROCESS, """
without-effect uncertainty | uncertainty={scenarios: [{time_constant: 1.0e-3, dead_time: 2.0}]}
not-a-plant uncertainty.scenarios[0] | uncertainty={scenarios: [{gain: 0}]}
delay-beyond-record uncertainty | uncertainty={intervals: {dead_time: [1, 5000]}}
"""),
    "loop error": (LOOP_ERROR, """
nothing-to-estimate plant.known | plant={parameters: {K: 2.0, T: 5.0, L: 2.3}, known: [K, T, L], continuous:
  {numerator: [K], denominator: [T, 1], delay: L}, sample: zoh} | noise.variance=0.04
nothing-to-estimate plant.known | plant={parameters: {K: 2.0, T: 5.0, L: 2.3}, known: [K, T, L], continuous:
  {numerator: [K], denominator: [T, 1], delay: L}, sample: zoh} | noise.C=[1, 0.3]
not-supported noise.drift | plant={LAGGED} | noise.drift=true
not-supported noise.D | plant={LAGGED} | noise={variance: 1, D: [1, -1], known: [d1]}
not-supported plant | plant={parameters: {K: 2.0, T: 5.0, L: 2.3}, continuous: {numerator: [K], denominator:
  [T, 0], delay: L}, sample: zoh} | title=x
not-supported plant | plant={parameters: {K: 2.0, T: 5.0, L: 2.3}, continuous: {numerator: [K], denominator:
  [T, 1], delay: L}} | title=x
not-supported plant.state_space.K | plant={parameters: {a: 0.5}, state_space: {time: discrete, A: [[a, 0], [0,
  0.3]], B: [[1, 0], [0, 1]], C: [[1, 0], [0.2, 1]], K: [[0.1, 0], [0, 0.1]]}} | title=x
"""),
    "response": (RESPONSE, """
not-supported experiment.controller | experiment.controller={"numerator": [0.1], "denominator": [1]}
not-supported noise.drift | noise.drift=true
not-supported spectrum | spectrum={"type": "fir"}
not-supported limits.energy | limits.energy=1.0
not-supported signal.hold | signal.hold=2
not-supported accuracy.model_error | accuracy.model_error={"relative": 0.1}
too-few-lines RESPONSE.lines | RESPONSE.lines=500
bad-period signal.periods | RESPONSE.transient=5
bad-period signal.periods | signal.periods=1
bad-period signal.periods | signal.periods=1 | RESPONSE.period=2000
bad-period signal.periods | signal.periods=1000
bad-period experiment.samples | signal=null | experiment.samples=14
bad-period RESPONSE.period | signal=null | RESPONSE.period=2000
out-of-range RESPONSE.period | RESPONSE.period=2
not-supported spectrum.given | spectrum={given: {type: white, power: 1}}
missing-key RESPONSE | RESPONSE.relative=null
needs-limits RESPONSE | objective="best_accuracy"
too-large experiment.samples | experiment.samples=100000000
not-supported uncertainty | uncertainty={"intervals": {"b1": [0.3, 0.5]}}
too-few-lines RESPONSE.frequencies[1] | RESPONSE={relative: 0.05, frequencies: [0.1, 0.101]}
out-of-range RESPONSE.frequencies[0] | RESPONSE={relative: 0.05, frequencies: [0.001]}
out-of-range RESPONSE.frequencies[0] | RESPONSE={relative: 0.05, frequencies: [3.14]}
out-of-range RESPONSE.detection | RESPONSE.detection=1
"""),
    "campaign": (CAMPAIGN, """
conflicting-keys campaign.stages | campaign.stages=[100, 50] | campaign.block=null
conflicting-keys campaign.block | campaign.block=300
conflicting-keys campaign.max_samples | campaign.max_samples=100
not-supported campaign | spectrum={given: {type: white, power: 1}}
not-supported campaign | objective=best_accuracy | limits.input_power=1
not-supported signal.least_move | signal.least_move=1 | limits.rate=2
not-supported signal.least_move | signal.least_move=1 | limits.amplitude={output: 2}
not-supported signal.least_move | signal.least_move=1 | campaign=null
conflicting-keys signal.least_move | signal.least_move=3 | limits.amplitude=2
"""),
    "two_by_two_arx": (None, """
out-of-range signal.bits | signal.bits=3 | signal.type=prbs
not-supported signal.type | signal.type=chirp
conflicting-keys signal.amplitudes | signal.amplitudes=[1, 9] | limits.amplitude=[2, 8]
wrong-shape signal.quantisation.range | signal.quantisation={bits: 4, range: [9, 9, 9]}
coarse-converter signal.offset | signal.quantisation={bits: 4, range: 9} | signal.offset=[0, 9]
coarse-converter limits.rate | signal.quantisation={bits: 4, range: 9} | limits.rate=[2, 1]
"""),
    "two_by_two_given": (None, """
unknown-parameter report.ellipses[0][0] | report={ellipses: [[b1, f1]]}
not-supported limits.spectrum | limits={spectrum: 5}
not-supported limits.energy | limits={energy: 5}
not-supported signal.phases | signal.phases=schroeder
"""),
    "first_order": (None, """
unknown-parameter report.ellipses[0][1] | report.ellipses=[[b1, f2]]
out-of-range accuracy.model_error.confidence.exact | CONFIDENCE {exact: 1.2}}}
out-of-range accuracy.model_error.confidence.draws | CONFIDENCE {exact: 0.99, draws: 100}}}
out-of-range accuracy.model_error.confidence.runs | CONFIDENCE {exact: 0.99, runs: 100}}}
too-large accuracy.model_error.confidence.draws | CONFIDENCE {exact: 0.9, draws: 1.0e9}}}
missing-key accuracy.model_error.confidence | CONFIDENCE {draws: 10}}}
conflicting-keys accuracy.model_error.confidence.exact | CONFIDENCE {exact: 0.9, ellipsoid: 0.9}}}
conflicting-keys accuracy.model_error.region | CONFIDENCE {exact: 0.9}, region: ellipsoid}}
"""),
    "regression": (None, """
nothing-asked accuracy | accuracy={}
not-supported objective | objective=shortest_experiment
not-supported report.ellipses | report.ellipses=[[b1, b2]]
"""),
    "distillation_column": (None, """
not-square CONTROL | plant.B=[[[0,1],[0,0.2],[0,0.3]],[[0,0.5],[0,1],[0,1]]]
not-square CONTROL.model_reference.numerator | CONTROL.model_reference={numerator: [[[0, 1], [0, 0.2]]]}
non-minimum-phase CONTROL.model_reference | plant.B=[[[0, 1, 2], [0, 0.2]], [[0, 0.5], [0, 1]]]
non-minimum-phase CONTROL.minimum_variance | plant.B=[[[0, 1, 2], [0, 0.2]], [[0, 0.5], [0, 1]]] |
  CONTROL={minimum_variance: true}
delay-too-short CONTROL.model_reference | CONTROL.model_reference={numerator: [0.5], denominator: [1, -0.5]}
delay-too-short CONTROL.model_reference | CONTROL.model_reference={continuous: {numerator: [1, 1],
  denominator: [75, 1]}}
delay-too-short CONTROL.model_reference | plant.B=[[[0, 0, 1], [0]], [[0], [0, 0, 1]]]
infinite-criterion CONTROL.model_reference | plant.B=[[[0, 1, -1], [0, 0]], [[0, 0], [0, 1]]]
infinite-criterion CONTROL.internal_model | plant.B=[[[0, 1, 1], [0, 0]], [[0, 0], [0, 1]]] |
  CONTROL={internal_model: {numerator: [0.5], denominator: [1, -0.5]}}
singular-plant plant.B | plant.B=[[[0, 1], [0, 1]], [[0, 2], [0, 2]]]
unstable-polynomial accuracy.closed_loop_error.reference.filter.denominator |
  accuracy.closed_loop_error.reference={filter: {numerator: [1], denominator: [1, -1]}}
unstable-polynomial CONTROL.model_reference.denominator | CONTROL.model_reference={numerator: [[[0, 1], [0]],
  [[0], [0, 1]]], denominator: [1, -1.1]}
wrong-shape CONTROL.model_reference.denominator | CONTROL.model_reference={numerator: [[[0, 1], [0]], [[0],
  [0, 1]]], denominator: [[[1]]]}
no-feedback CONTROL.minimum_variance | noise.C=[1, -0.9736857494] | CONTROL={minimum_variance: true}
needs-limits accuracy.closed_loop_error | limits=null
not-supported limits.amplitude.output | limits.amplitude={output: 3}
not-supported limits.input_power.min | limits.input_power={max: 2, min: 1}
not-supported spectrum.type | spectrum={type: fir, order: 3}
not-supported accuracy.model_error | accuracy.model_error={relative: 0.1}
not-supported CONTROL.minimum_variance | plant.B=[[[0, 1], [0, 0]], [[0, 0], [0, 0, 1]]] |
  CONTROL={minimum_variance: true}
conflicting-keys signal.periods | signal.periods=3
unsuitable-key signal.order | signal={type: multisine, order: 4}
not-supported signal.type | signal={type: filtered_noise} | accuracy.closed_loop_error.covariance=parametric
"""),
    "regression_fir": (None, """
wrong-shape SQUARED.estimated | SQUARED.estimated=[1, 2]
out-of-range SQUARED.target | SQUARED.target=0
out-of-range SQUARED.neglected_norm | SQUARED.neglected_norm=-0.1
out-of-range noise.variance | noise.variance=0
out-of-range limits.energy | SQUARED.target=null | limits.energy=0
not-supported limits.energy | limits.energy=3
zero-weights SQUARED.estimated | SQUARED.estimated=[0]
unsuitable-key noise.C | noise.C=[1, 0.5]
not-supported experiment.prior | experiment.prior={information: [[1]]}
not-supported limits.amplitude | limits.amplitude=1
not-supported solver.method | solver.method=lmi
not-supported signal.type | signal.type=multisine
not-supported cost | cost={input_power: 2}
not-supported SQUARED | spectrum={given: {type: white, power: 1}}
"""),
    "motor_loop": (None, """
algebraic-loop experiment.controller | plant.continuous={numerator: [1, 9], denominator: [1, 2]}
infinite-information plant | plant.continuous.denominator=[1, 12, 0]
unstable-loop experiment.controller | accuracy.model_error.sensitivity={max_db: 6, controller: {numerator:
  [-11], denominator: [1]}}
wrong-shape accuracy.model_error.sensitivity.controller.numerator | accuracy.model_error.sensitivity={max_db:
  6, controller: {numerator: [[[9]]]}}
"""),
}  # fmt: skip
# Abbreviations in the rows.
NAMES = {
    "GIVEN_ONE": "spectrum={given: {type: white, power: 3}} | uncertainty={scenarios: [{b1: 0.45}]}",
    "LAGGED": "parameters: {K: 2.0, T: 5.0, L: 2.3}, sample: zoh, "
    "continuous: {numerator: [K], denominator: [T, 1], delay: L}",
    "UNDER": "experiment={samples: 300, controller:",
    "CONTROL": "accuracy.closed_loop_error.control",
    "CONFIDENCE": "accuracy={model_error: {absolute: 0.1, confidence:",
    "RESPONSE": "accuracy.frequency_response",
    "SQUARED": "accuracy.mean_squared_error",
    "=ONE": f"={ONE}",
    "=TWO": f"={' '.join(TWO.split())}",
    "COVARIANCE": COVARIANCE,
}


def row_of(text):
    """The code and key of a row, and its changes."""
    text = " ".join(text.split())
    for short, long in NAMES.items():
        text = text.replace(short, long)
    return text.split(" | ")


ROWS = [
    (name, *row_of(row)) for name, (_, table) in TABLES.items() for row in re.split(r"\n(?! )", table.strip())
]
# Codes of the schema, whose messages need no hint.
PLAIN = ("not-a-number", "out-of-range", "unknown-word", "zero-polynomial")


@pytest.mark.parametrize("row", ROWS, ids=lambda row: " ".join(row)[:80])
def test_an_invalid_spec_is_refused_with_code_key_place_and_hint(row):
    name, expected, *changes = row
    text = TABLES[name][0]
    found = refusals(
        lambda: validate(
            parse_spec(text, overrides=changes) if text else load_spec(f"specs/{name}.yaml", changes)
        )
    )
    assert expected in [f"{one.code} {one.key}" for one in found]
    assert all(one.location and (one.hint or one.code in PLAIN) for one in found)
