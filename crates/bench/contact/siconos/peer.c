/* Siconos on one frictional contact problem or linear complementarity problem: one solver from r = 0, its own
   tolerance tightened tenfold until the measures of the benchmark hold at each asked tolerance.

     peer PROBLEM.bin SOLVER TOLERANCES FIRST REPEATS BUDGET LIMIT OUT
     peer --list

   PROBLEM.bin  flat little-endian: i32 d, nc, nnz; i32 indptr[d nc + 1]; i32 indices[nnz]; f64 values[nnz];
                f64 q[d nc] [m/s]; f64 mu[nc]. d = 1 is a linear complementarity problem.
   TOLERANCES   ascending in difficulty, with commas: 1e-4,1e-8
   FIRST        the solver's own tolerance to begin with, over the one asked for: 1 is what a user would set
   REPEATS      at most so many timed runs at a setting that passed, within BUDGET [s]
   LIMIT        CPU seconds of one call, a third of those of all settings tried; longer ends the program
   OUT          impulses go to OUT.TOLERANCE.bin, f64[d nc], and a line of JSON per tolerance reached to OUT.jsonl:
                what the library prints goes elsewhere

   Timed: CPU time of this thread in the driver call alone; calls shorter than SHORT several at a time, each
   from a state of its own made before. The measures here
   only steer: whether a line counts is judged by another program from the impulses. */

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <siconos/numerics/SiconosNumerics.h>
#include <siconos/numerics/FrictionContactProblem.h>
#include <siconos/numerics/Friction_cst.h>
#include <siconos/numerics/LinearComplementarityProblem.h>
#include <siconos/numerics/NonSmoothDrivers.h>
#include <siconos/numerics/NumericsMatrix.h>
#include <siconos/numerics/NumericsVerbose.h>
#include <siconos/numerics/SolverOptions.h>
#include <siconos/numerics/SparseBlockMatrix.h>
#include <siconos/numerics/lcp_cst.h>

typedef enum { BLOCKS, SPARSE, DENSE } Storage;

typedef struct {
  int d, nc, n, nnz;
  int *indptr, *indices;
  double *values, *q, *mu, *largest; /* largest: spectral norm of each diagonal block */
  double size;                       /* |q|, 1 when that is 0 */
} Problem;

typedef struct {
  const char *name;
  int dimension; /* 1, 2 or 3 */
  int id;        /* of Siconos */
  int local;     /* solver of one contact, 0 for the default */
  Storage storage;
  int iterations;
  void (*set)(SolverOptions *);
} Variant;

static void every_tenth(SolverOptions *o) {
  o->iparam[SICONOS_FRICTION_3D_IPARAM_ERROR_EVALUATION] = SICONOS_FRICTION_3D_NSGS_ERROR_EVALUATION_FULL;
  o->iparam[SICONOS_FRICTION_3D_IPARAM_ERROR_EVALUATION_FREQUENCY] = 10;
}
static void light(SolverOptions *o) {
  o->iparam[SICONOS_FRICTION_3D_IPARAM_ERROR_EVALUATION] =
      SICONOS_FRICTION_3D_NSGS_ERROR_EVALUATION_LIGHT_WITH_FULL_FINAL;
}
static void balanced(SolverOptions *o) {
  o->iparam[SICONOS_FRICTION_3D_ADMM_IPARAM_RHO_STRATEGY] =
      SICONOS_FRICTION_3D_ADMM_RHO_STRATEGY_RESIDUAL_BALANCING;
}
static void scaled_balanced(SolverOptions *o) {
  o->iparam[SICONOS_FRICTION_3D_ADMM_IPARAM_RHO_STRATEGY] =
      SICONOS_FRICTION_3D_ADMM_RHO_STRATEGY_SCALED_RESIDUAL_BALANCING;
}
static void adaptive(SolverOptions *o) {
  o->iparam[SICONOS_FRICTION_3D_IPARAM_ERROR_EVALUATION] = SICONOS_FRICTION_3D_NSGS_ERROR_EVALUATION_ADAPTIVE;
}
static void mumps(SolverOptions *o) {
  SolverOptions *newton = o->solverId == SICONOS_FRICTION_3D_PROX ? o->internalSolvers[0] : o;
  newton->iparam[SICONOS_FRICTION_3D_NSN_LINEAR_SOLVER] = SICONOS_FRICTION_3D_NSN_USE_MUMPS;
}
static void as_given(SolverOptions *o) { (void)o; }

#define LOCAL(x) SICONOS_FRICTION_3D_ONECONTACT_##x

static const Variant VARIANTS[] = {
    {"nsgs_hyb", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(NSN_GP_HYBRID), BLOCKS, 1000000, as_given},
    {"nsgs_ac", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(NSN), BLOCKS, 1000000, as_given},
    {"nsgs_gp", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(NSN_GP), BLOCKS, 1000000, as_given},
    {"nsgs_pli", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(ProjectionOnConeWithLocalIteration), BLOCKS, 1000000, as_given},
    {"nsgs_em", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(QUARTIC), BLOCKS, 1000000, as_given},
    {"nsgs_em_nu", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(QUARTIC_NU), BLOCKS, 1000000, as_given},
    {"nsgs_p", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(ProjectionOnCone), BLOCKS, 1000000, as_given},
    {"nsgs_pd", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(ProjectionOnConeWithDiagonalization), BLOCKS, 1000000, as_given},
    {"nsgs_ac_freq", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(NSN), BLOCKS, 1000000, every_tenth},
    {"nsgs_ac_adaptive", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(NSN), BLOCKS, 1000000, adaptive},
    {"nsgs_hyb_light", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(NSN_GP_HYBRID), BLOCKS, 1000000, light},
    {"nsgs_em_light", 3, SICONOS_FRICTION_3D_NSGS, LOCAL(QUARTIC), BLOCKS, 1000000, light},
    {"vi_eg", 3, SICONOS_FRICTION_3D_VI_EG, 0, BLOCKS, 1000000, as_given},
    {"vi_fpp", 3, SICONOS_FRICTION_3D_VI_FPP, 0, BLOCKS, 1000000, as_given},
    {"prox_nsn", 3, SICONOS_FRICTION_3D_PROX, 0, SPARSE, 1000, as_given},
    {"prox_nsn_dense", 3, SICONOS_FRICTION_3D_PROX, 0, DENSE, 1000, as_given},
    {"prox_nsn_blocks", 3, SICONOS_FRICTION_3D_PROX, 0, BLOCKS, 1000, as_given},
    {"prox_nsn_mumps", 3, SICONOS_FRICTION_3D_PROX, 0, SPARSE, 1000, mumps},
    {"nsn_ac", 3, SICONOS_FRICTION_3D_NSN_AC, 0, SPARSE, 1000, as_given},
    {"nsn_ac_dense", 3, SICONOS_FRICTION_3D_NSN_AC, 0, DENSE, 1000, as_given},
    {"nsn_fb", 3, SICONOS_FRICTION_3D_NSN_FB, 0, SPARSE, 1000, as_given},
    {"nsn_fb_dense", 3, SICONOS_FRICTION_3D_NSN_FB, 0, DENSE, 1000, as_given},
    {"nsn_fb_blocks", 3, SICONOS_FRICTION_3D_NSN_FB, 0, BLOCKS, 1000, as_given},
    {"nsn_fb_mumps", 3, SICONOS_FRICTION_3D_NSN_FB, 0, SPARSE, 1000, mumps},
    {"nsn_nm", 3, SICONOS_FRICTION_3D_NSN_NM, 0, SPARSE, 1000, as_given},
    {"nsn_nm_dense", 3, SICONOS_FRICTION_3D_NSN_NM, 0, DENSE, 1000, as_given},
    {"admm", 3, SICONOS_FRICTION_3D_ADMM, 0, SPARSE, 1000000, as_given},
    {"admm_br", 3, SICONOS_FRICTION_3D_ADMM, 0, SPARSE, 1000000, balanced},
    {"admm_sbr", 3, SICONOS_FRICTION_3D_ADMM, 0, SPARSE, 1000000, scaled_balanced},
    {"fc2d_nsgs", 2, SICONOS_FRICTION_2D_NSGS, 0, BLOCKS, 1000000, as_given},
    {"fc2d_nsgs_dense", 2, SICONOS_FRICTION_2D_NSGS, 0, DENSE, 1000000, as_given},
    {"fc2d_cpg", 2, SICONOS_FRICTION_2D_CPG, 0, DENSE, 1000000, as_given},
    {"fc2d_lemke", 2, SICONOS_FRICTION_2D_LEMKE, 0, DENSE, 100000, as_given},
    {"lcp_lemke", 1, SICONOS_LCP_LEMKE, 0, DENSE, 100000, as_given},
    {"lcp_newton_fb", 1, SICONOS_LCP_NEWTON_FB_FBLSA, 0, DENSE, 1000, as_given},
    {"lcp_newton_min", 1, SICONOS_LCP_NEWTON_MIN_FBLSA, 0, DENSE, 1000, as_given},
    {"lcp_pgs", 1, SICONOS_LCP_PGS, 0, DENSE, 1000000, as_given},
    {"lcp_pivot", 1, SICONOS_LCP_PIVOT, 0, DENSE, 100000, as_given},
};
#define VARIANT_COUNT (sizeof VARIANTS / sizeof VARIANTS[0])

/* --- the problem --- */

static void *take(FILE *f, size_t size, size_t count) {
  void *p = malloc(size * count + 1);
  if (!p || fread(p, size, count, f) != count) {
    fprintf(stderr, "the problem file is cut short\n");
    exit(2);
  }
  return p;
}

static double entry(const Problem *p, int row, int column) {
  double sum = 0;
  for (int k = p->indptr[row]; k < p->indptr[row + 1]; ++k)
    if (p->indices[k] == column) sum += p->values[k];
  return sum;
}

/* largest singular value of the i-th diagonal block, by 200 steps of the power method on B^T B */
static double block_norm(const Problem *p, int i) {
  double b[3][3], x[3] = {1, 0.7, 0.4}, largest = 0;
  for (int r = 0; r < p->d; ++r)
    for (int c = 0; c < p->d; ++c) b[r][c] = entry(p, p->d * i + r, p->d * i + c);
  for (int step = 0; step < 200; ++step) {
    double y[3] = {0}, z[3] = {0}, length = 0;
    for (int r = 0; r < p->d; ++r)
      for (int c = 0; c < p->d; ++c) y[r] += b[r][c] * x[c];
    for (int r = 0; r < p->d; ++r)
      for (int c = 0; c < p->d; ++c) z[c] += b[r][c] * y[r];
    for (int c = 0; c < p->d; ++c) length += z[c] * z[c];
    length = sqrt(length);
    if (!(length > 0)) return 1;
    for (int c = 0; c < p->d; ++c) x[c] = z[c] / length;
    largest = sqrt(length);
  }
  return largest;
}

static Problem read_problem(const char *path) {
  FILE *f = fopen(path, "rb");
  if (!f) {
    perror(path);
    exit(2);
  }
  Problem p;
  int *head = take(f, sizeof(int), 3);
  p.d = head[0], p.nc = head[1], p.nnz = head[2], p.n = p.d * p.nc;
  free(head);
  p.indptr = take(f, sizeof(int), p.n + 1);
  p.indices = take(f, sizeof(int), p.nnz);
  p.values = take(f, sizeof(double), p.nnz);
  p.q = take(f, sizeof(double), p.n);
  p.mu = take(f, sizeof(double), p.nc);
  fclose(f);
  double sum = 0;
  for (int k = 0; k < p.n; ++k) sum += p.q[k] * p.q[k];
  p.size = sum > 0 ? sqrt(sum) : 1;
  p.largest = malloc(sizeof(double) * p.nc);
  for (int i = 0; i < p.nc; ++i) p.largest[i] = block_norm(&p, i);
  return p;
}

static NumericsMatrix *dense(const Problem *p) {
  NumericsMatrix *m = NM_create(NM_DENSE, p->n, p->n);
  memset(m->matrix0, 0, sizeof(double) * p->n * p->n);
  for (int r = 0; r < p->n; ++r)
    for (int k = p->indptr[r]; k < p->indptr[r + 1]; ++k)
      m->matrix0[r + (size_t)p->n * p->indices[k]] += p->values[k];
  return m;
}

static NumericsMatrix *sparse(const Problem *p) {
  NumericsMatrix *m = NM_create(NM_SPARSE, p->n, p->n);
  NM_triplet_alloc(m, p->nnz);
  m->matrix2->origin = NSM_TRIPLET;
  for (int r = 0; r < p->n; ++r)
    for (int k = p->indptr[r]; k < p->indptr[r + 1]; ++k) NM_entry(m, r, p->indices[k], p->values[k]);
  return m;
}

/* d x d blocks by columns, the diagonal ones always present */
static NumericsMatrix *blocks(const Problem *p) {
  int d = p->d, nc = p->nc, total = 0;
  int *seen = malloc(sizeof(int) * nc);
  for (int i = 0; i < nc; ++i) seen[i] = -1;
  SparseBlockStructuredMatrix *s = SBM_new();
  s->blocknumber0 = s->blocknumber1 = nc;
  s->blocksize0 = malloc(sizeof(unsigned int) * nc);
  s->blocksize1 = malloc(sizeof(unsigned int) * nc);
  s->index1_data = malloc(sizeof(size_t) * (nc + 1));
  s->index2_data = malloc(sizeof(size_t) * (p->nnz + nc));
  s->block = malloc(sizeof(double *) * (p->nnz + nc));
  s->filled1 = nc + 1;
  for (int i = 0; i < nc; ++i) {
    s->blocksize0[i] = s->blocksize1[i] = d * (i + 1);
    s->index1_data[i] = total;
    int start = total;
    seen[i] = i;
    s->index2_data[total++] = i;
    for (int r = d * i; r < d * i + d; ++r)
      for (int k = p->indptr[r]; k < p->indptr[r + 1]; ++k) {
        int j = p->indices[k] / d;
        if (seen[j] != i) {
          seen[j] = i;
          s->index2_data[total++] = j;
        }
      }
    for (int a = start + 1; a < total; ++a) /* insertion sort: rows are short */
      for (int b = a; b > start && s->index2_data[b] < s->index2_data[b - 1]; --b) {
        size_t t = s->index2_data[b];
        s->index2_data[b] = s->index2_data[b - 1];
        s->index2_data[b - 1] = t;
      }
    for (int a = start; a < total; ++a) {
      double *block = calloc(d * d, sizeof(double));
      int j = (int)s->index2_data[a];
      for (int r = 0; r < d; ++r)
        for (int k = p->indptr[d * i + r]; k < p->indptr[d * i + r + 1]; ++k)
          if (p->indices[k] / d == j) block[r + d * (p->indices[k] % d)] += p->values[k];
      s->block[a] = block;
    }
  }
  s->index1_data[nc] = total;
  s->nbblocks = total;
  s->filled2 = total;
  free(seen);
  return NM_new_SBM(p->n, p->n, s);
}

/* --- the measures --- */

static void project(const double *x, double *out, int d, double mu) {
  double t = 0;
  for (int k = 1; k < d; ++k) t += x[k] * x[k];
  t = sqrt(t);
  memcpy(out, x, sizeof(double) * d);
  if (t <= mu * x[0]) return;
  if (mu * t <= -x[0]) {
    memset(out, 0, sizeof(double) * d);
    return;
  }
  out[0] = (x[0] + mu * t) / (1 + mu * mu);
  for (int k = 1; k < d; ++k) out[k] = mu * out[0] * x[k] / t;
}

/* projects r on the cones, then: max of natural and a tenth of scaled; of an lcp |min(z, w)| / max(1, |q|) */
static double measure(const Problem *p, double *r) {
  double *u = malloc(sizeof(double) * p->n), natural = 0, scaled = 0, low = 0;
  for (int i = 0; i < p->nc; ++i) {
    double on[3];
    project(r + p->d * i, on, p->d, p->mu[i]);
    memcpy(r + p->d * i, on, sizeof(double) * p->d);
  }
  for (int k = 0; k < p->n; ++k) {
    u[k] = p->q[k];
    for (int j = p->indptr[k]; j < p->indptr[k + 1]; ++j) u[k] += p->values[j] * r[p->indices[j]];
  }
  for (int i = 0; i < p->nc; ++i) {
    double *w = u + p->d * i, *x = r + p->d * i, slip = 0;
    if (p->d == 1) low += fmin(*w, *x) * fmin(*w, *x);
    for (int k = 1; k < p->d; ++k) slip += w[k] * w[k];
    w[0] += p->mu[i] * sqrt(slip);
    for (int which = 0; which < 2; ++which) {
      double step = which ? 1 / p->largest[i] : 1, y[3], on[3], sum = 0;
      for (int k = 0; k < p->d; ++k) y[k] = x[k] - step * w[k];
      project(y, on, p->d, p->mu[i]);
      for (int k = 0; k < p->d; ++k) sum += pow((x[k] - on[k]) / step, 2);
      *(which ? &scaled : &natural) += sum;
    }
  }
  free(u);
  double worth = fmax(sqrt(natural), sqrt(scaled) / 10) / p->size;
  if (p->d == 1) worth = sqrt(low) / fmax(1, p->size);
  return isfinite(worth) ? worth : INFINITY;
}

/* --- one call --- */

typedef struct {
  double seconds;
  int iterations;
  int info;
} Call;

static double now(clockid_t clock) {
  struct timespec t;
  clock_gettime(clock, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* what is timed in less is timed by the clock on the wall: it can be repeated until nobody disturbs it, and the CPU clock of a
   machine that others share loses time now and then, so that its best of many is too good; the others do the same */
#define BRIEF 10e-3

static double spent(double cpu, double wall) {
  double on_the_wall = now(CLOCK_MONOTONIC) - wall;
  return on_the_wall < BRIEF ? on_the_wall : now(CLOCK_THREAD_CPUTIME_ID) - cpu;
}

/* reading the clock takes a good part of a microsecond: calls shorter than this are timed so many at a time that
   they fill it together, at most MANY; the timed programs of the others do the same */
#define SHORT 20e-6
#define MANY 64

/* what a call reads and writes, the options among it */
typedef struct {
  double *r, *u, *q, *mu;
  SolverOptions *o;
} State;

static State fresh(const Problem *p, const Variant *v, double tolerance) {
  State s = {calloc(p->n, sizeof(double)), calloc(p->n, sizeof(double)), malloc(sizeof(double) * p->n),
             malloc(sizeof(double) * p->nc), solver_options_create(v->id)};
  memcpy(s.q, p->q, sizeof(double) * p->n);
  memcpy(s.mu, p->mu, sizeof(double) * p->nc);
  s.o->dparam[SICONOS_DPARAM_TOL] = tolerance;
  s.o->iparam[SICONOS_IPARAM_MAX_ITER] = v->iterations;
  s.o->filterOn = false;
  if (v->local) solver_options_update_internal(s.o, 0, v->local);
  v->set(s.o);
  return s;
}

static int drive(const Problem *p, NumericsMatrix *m, State *s) {
  if (p->d == 1) {
    LinearComplementarityProblem problem = {p->n, m, s->q};
    return linearComplementarity_driver(&problem, s->r, s->u, s->o);
  }
  FrictionContactProblem problem = {p->d, p->nc, m, s->q, s->mu};
  return p->d == 2 ? fc2d_driver(&problem, s->r, s->u, s->o) : fc3d_driver(&problem, s->r, s->u, s->o);
}

static int together(double seconds) {
  return seconds < SHORT ? (int)fmin(MANY, ceil(SHORT / fmax(seconds, 1e-9))) : 1;
}

/* count calls one after another, seconds of one of them; r is what the first found */
static Call calls(const Problem *p, NumericsMatrix *m, const Variant *v, double tolerance, double *r, int count) {
  State states[MANY];
  for (int k = 0; k < count; ++k) states[k] = fresh(p, v, tolerance);
  Call c = {0};
  double cpu = now(CLOCK_THREAD_CPUTIME_ID), wall = now(CLOCK_MONOTONIC);
  for (int k = 0; k < count; ++k) c.info = drive(p, m, &states[k]);
  c.seconds = spent(cpu, wall) / count;
  c.iterations = states[0].o->iparam[SICONOS_IPARAM_ITER_DONE];
  memcpy(r, states[0].r, sizeof(double) * p->n);
  for (int k = 0; k < count; ++k) {
    solver_options_delete(states[k].o);
    free(states[k].r), free(states[k].u), free(states[k].q), free(states[k].mu);
  }
  return c;
}

static Call call(const Problem *p, NumericsMatrix *m, const Variant *v, double tolerance, double *r) {
  return calls(p, m, v, tolerance, r, 1);
}

static void out_of_time(int signal) {
  (void)signal;
  _exit(124);
}

static void allow(double seconds) {
  struct itimerval t = {{0, 0}, {(time_t)seconds, (suseconds_t)(1e6 * (seconds - floor(seconds)))}};
  setitimer(ITIMER_PROF, &t, NULL);
}

static void report(const char *out, const char *asked, const Variant *v, double own, Call best, double worth,
                   const double *r, int n) {
  char path[4096];
  snprintf(path, sizeof path, "%s.%s.bin", out, asked);
  FILE *f = fopen(path, "wb");
  if (!f || fwrite(r, sizeof(double), n, f) != (size_t)n || fclose(f)) {
    perror(path);
    exit(2);
  }
  snprintf(path, sizeof path, "%s.jsonl", out);
  f = fopen(path, "a");
  if (!f) {
    perror(path);
    exit(2);
  }
  fprintf(f,
          "{\"solver\": \"%s\", \"tolerance\": %s, \"own_tolerance\": %g, \"seconds\": %.9g, "
          "\"iterations\": %d, \"steering_error\": %.3e, \"impulses\": \"%s.%s.bin\"}\n",
          v->name, asked, own, best.seconds, best.iterations, worth, out, asked);
  fclose(f);
}

int main(int count, char **words) {
  if (count == 2 && !strcmp(words[1], "--list")) {
    for (size_t k = 0; k < VARIANT_COUNT; ++k) printf("%d %s\n", VARIANTS[k].dimension, VARIANTS[k].name);
    return 0;
  }
  if (count != 9) {
    fprintf(stderr, "usage: peer PROBLEM.bin SOLVER TOLERANCES FIRST REPEATS BUDGET LIMIT OUT | peer --list\n");
    return 2;
  }
  const Variant *v = NULL;
  for (size_t k = 0; k < VARIANT_COUNT; ++k)
    if (!strcmp(VARIANTS[k].name, words[2])) v = &VARIANTS[k];
  Problem p = read_problem(words[1]);
  if (!v || v->dimension != p.d) {
    fprintf(stderr, "no solver %s for %d rows per contact\n", words[2], p.d);
    return 2;
  }
  int repeats = atoi(words[5]);
  double budget = atof(words[6]), limit = atof(words[7]);
  numerics_set_verbose(0);
  signal(SIGPROF, out_of_time);
  NumericsMatrix *m = v->storage == DENSE ? dense(&p) : v->storage == SPARSE ? sparse(&p) : blocks(&p);
  double *r = malloc(sizeof(double) * p.n), *kept = malloc(sizeof(double) * p.n);
  double own = 0, climbed = 0;
  for (char *asked = strtok(words[3], ","); asked; asked = strtok(NULL, ",")) {
    double wanted = atof(asked), worth = INFINITY;
    Call best = {0};
    own = own > 0 ? fmin(own, wanted * atof(words[4])) : wanted * atof(words[4]);
    double first = own;
    for (; own > 1e-17; own *= 0.1) {
      allow(limit);
      best = call(&p, m, v, own, r);
      allow(0);
      worth = measure(&p, r);
      climbed += best.seconds;
      /* out of iterations already: a tighter tolerance follows the same path */
      if (worth <= wanted || best.info || climbed > 3 * limit) break;
    }
    if (!(worth <= wanted)) return 1;
    memcpy(kept, r, sizeof(double) * p.n);
    /* a setting between the last that failed and this one may do */
    double chosen = own, between = own * sqrt(10.0), other = INFINITY;
    Call looser = {0};
    if (own < first) {
      allow(limit);
      looser = call(&p, m, v, between, r);
      allow(0);
      other = measure(&p, r);
    }
    if (other <= wanted && looser.seconds < best.seconds) {
      chosen = between, best = looser, worth = other;
      memcpy(kept, r, sizeof(double) * p.n);
    }
    double spent = best.seconds;
    for (int k = 1; k < repeats && spent + best.seconds < budget; ++k) {
      int count = together(best.seconds);
      Call again = calls(&p, m, v, chosen, r, count);
      spent += count * again.seconds;
      if (again.seconds < best.seconds) best = again;
    }
    report(words[8], asked, v, chosen, best, worth, kept, p.n);
  }
  return 0;
}
