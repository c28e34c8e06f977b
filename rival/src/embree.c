/* Hemicube rows by Embree 3: packets of 16 coherent rays, the patch from (u, v), the weights added up.
 *
 * What the rival is given: the directions of all cells in the hemicube's axes, ready in packets of 4 x 4 (8 x 2
 * where the rows left over are two); one addition for a packet that shows one patch throughout; denormals
 * flushed, as Embree asks; the compiler's best for this very processor. */

#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { LANES = 16 };

/* As in rival.rs. */
typedef struct {
    float corners[4][3];
    uint32_t count; /* 3 or 4 */
    uint32_t first, columns, rows;
} Facet;

/* As in rival.rs. A lane that holds no ray has weight 0 and cell -1. */
typedef struct {
    float x[LANES], y[LANES], normal[LANES];
    int32_t valid[LANES];
    int32_t cell[LANES];
    double weight[LANES];
    double sum;
} __attribute__((aligned(64))) Packet;

typedef struct {
    RTCDevice device;
    RTCScene scene;
    /* A facet's number here is its geometry's start and its number there; one more stands for a miss. */
    int32_t starts[2];
    int32_t missed;
    int32_t *first, *columns, *rows;
} Rival;

static void *buffer(RTCGeometry geometry, enum RTCBufferType type, enum RTCFormat format, size_t stride, size_t count) {
    return rtcSetNewGeometryBuffer(geometry, type, 0, format, stride, count);
}

/* Parallelograms are quads of Embree's, whose (u, v) are ours; triangles likewise. */
static void attach(Rival *rival, const Facet *facets, uint32_t count, uint32_t corners, int32_t *next) {
    uint32_t chosen = 0;
    for (uint32_t k = 0; k < count; k++) chosen += facets[k].count == corners;
    int kind = corners == 4;
    rival->starts[kind] = *next;
    if (chosen == 0) return;
    RTCGeometry geometry =
        rtcNewGeometry(rival->device, kind ? RTC_GEOMETRY_TYPE_QUAD : RTC_GEOMETRY_TYPE_TRIANGLE);
    float *vertices =
        buffer(geometry, RTC_BUFFER_TYPE_VERTEX, RTC_FORMAT_FLOAT3, sizeof(float[3]), (size_t)chosen * corners);
    uint32_t *indices = buffer(geometry, RTC_BUFFER_TYPE_INDEX, kind ? RTC_FORMAT_UINT4 : RTC_FORMAT_UINT3,
                               corners * sizeof(uint32_t), chosen);
    for (uint32_t k = 0, at = 0; k < count; k++) {
        if (facets[k].count != corners) continue;
        memcpy(vertices + (size_t)at * corners * 3, facets[k].corners, corners * sizeof(float[3]));
        for (uint32_t c = 0; c < corners; c++) indices[at * corners + c] = at * corners + c;
        rival->first[*next] = (int32_t)facets[k].first;
        rival->columns[*next] = (int32_t)facets[k].columns;
        rival->rows[*next] = (int32_t)facets[k].rows;
        at++, (*next)++;
    }
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_HIGH);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(rival->scene, geometry, (unsigned)kind);
    rtcReleaseGeometry(geometry);
}

Rival *rival_new(const Facet *facets, uint32_t count, uint32_t patches, int robust) {
    Rival *rival = calloc(1, sizeof *rival);
    rival->device = rtcNewDevice("threads=1");
    if (!rival->device) {
        free(rival);
        return NULL;
    }
    rival->scene = rtcNewScene(rival->device);
    rtcSetSceneBuildQuality(rival->scene, RTC_BUILD_QUALITY_HIGH);
    rtcSetSceneFlags(rival->scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rival->first = malloc((count + 1) * sizeof(int32_t));
    rival->columns = malloc((count + 1) * sizeof(int32_t));
    rival->rows = malloc((count + 1) * sizeof(int32_t));
    int32_t next = 0;
    attach(rival, facets, count, 3, &next);
    attach(rival, facets, count, 4, &next);
    rival->missed = next;
    rival->first[next] = (int32_t)patches;
    rival->columns[next] = rival->rows[next] = 1;
    rtcCommitScene(rival->scene);
    return rival;
}

void rival_free(Rival *rival) {
    rtcReleaseScene(rival->scene);
    rtcReleaseDevice(rival->device);
    free(rival->first), free(rival->columns), free(rival->rows);
    free(rival);
}

/* Embree's version (30,000 and more), and whether it traces packets of 16 as such. */
void rival_about(const Rival *rival, int64_t about[2]) {
    about[0] = rtcGetDeviceProperty(rival->device, RTC_DEVICE_PROPERTY_VERSION);
    about[1] = rtcGetDeviceProperty(rival->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED);
}

/* Cast the packets from `centre`; `row` (zeros, one more entry than patches) gets the weights, and `seen`, unless null,
 * the patch of every cell. Without `row` the rays are traced, and no more. */
void rival_cast(const Rival *rival, const Packet *packets, uint32_t count, const float centre[3],
                const float axes[3][3], float near, double *row, uint32_t *seen) {
    unsigned state = _mm_getcsr();
    _mm_setcsr(state | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON);
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    struct RTCRayHit16 rays;
    memset(&rays, 0, sizeof rays);
    for (int k = 0; k < LANES; k++) {
        rays.ray.org_x[k] = centre[0], rays.ray.org_y[k] = centre[1], rays.ray.org_z[k] = centre[2];
        rays.ray.tnear[k] = near;
        rays.ray.mask[k] = ~0u;
    }
    for (uint32_t p = 0; p < count; p++) {
        const Packet *packet = packets + p;
        for (int k = 0; k < LANES; k++) {
            float x = packet->x[k], y = packet->y[k], n = packet->normal[k];
            rays.ray.dir_x[k] = x * axes[0][0] + y * axes[1][0] + n * axes[2][0];
            rays.ray.dir_y[k] = x * axes[0][1] + y * axes[1][1] + n * axes[2][1];
            rays.ray.dir_z[k] = x * axes[0][2] + y * axes[1][2] + n * axes[2][2];
            rays.ray.tfar[k] = 3e38f;
            rays.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
        }
        rtcIntersect16(packet->valid, rival->scene, &context, &rays);
        if (!row) continue;
        int32_t patch[LANES];
        int32_t differing = 0;
        for (int k = 0; k < LANES; k++) {
            int32_t kind = (int32_t)rays.hit.geomID[k];
            int32_t start = kind == 0 ? rival->starts[0] : rival->starts[1];
            int32_t facet = kind < 0 ? rival->missed : start + (int32_t)rays.hit.primID[k];
            int32_t columns = rival->columns[facet], rows = rival->rows[facet];
            /* A missed lane's (u, v) are those of an earlier hit: it has one column and one row. */
            int32_t column = (int32_t)(rays.hit.u[k] * (float)columns);
            int32_t line = (int32_t)(rays.hit.v[k] * (float)rows);
            column = column < 0 ? 0 : column < columns ? column : columns - 1;
            line = line < 0 ? 0 : line < rows ? line : rows - 1;
            patch[k] = rival->first[facet] + line * columns + column;
        }
        for (int k = 0; k < LANES; k++) differing |= patch[k] ^ patch[0];
        if (!differing) {
            row[patch[0]] += packet->sum;
        } else {
            for (int k = 0; k < LANES; k++) row[patch[k]] += packet->weight[k];
        }
        if (seen) {
            for (int k = 0; k < LANES; k++) {
                if (packet->cell[k] >= 0) seen[packet->cell[k]] = (uint32_t)patch[k];
            }
        }
    }
    _mm_setcsr(state);
}

/* The processor time of this thread: others who use the machine do not count. */
double rival_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
