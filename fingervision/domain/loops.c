/* The door between Python and the loops: arrays become pointers, and what comes back becomes numbers.

   Only the stable part of Python's C interface is used (PEP 384, with buffers since Python 3.11). What is needed of it is
   declared here, so that building needs a C compiler and no headers of Python. */

#ifdef _WIN32
#define FROM_PYTHON extern __declspec(dllimport)
#define TO_PYTHON __declspec(dllexport)
#else
#define FROM_PYTHON extern
#define TO_PYTHON __attribute__((visibility("default")))
#endif

typedef struct _object PyObject;
typedef ptrdiff_t Py_ssize_t;
typedef struct {
    void *buf;
    PyObject *obj;
    Py_ssize_t len, itemsize;
    int readonly, ndim;
    char *format;
    Py_ssize_t *shape, *strides, *suboffsets;
    void *internal;
} Py_buffer;
typedef struct {
    const char *name;
    PyObject *(*function)(PyObject *, PyObject *const *, Py_ssize_t);
    int flags;
    const char *words;
} PyMethodDef;
typedef struct {
    Py_ssize_t count;
    void *type;
    PyObject *(*make)(void);
    Py_ssize_t index;
    PyObject *copy;
    const char *name, *words;
    Py_ssize_t size;
    PyMethodDef *methods;
    void *slots, *traverse, *clear, *release;
} PyModuleDef;

FROM_PYTHON PyObject *PyExc_TypeError;
FROM_PYTHON PyObject *PyErr_Format(PyObject *, const char *, ...);
FROM_PYTHON PyObject *PyErr_Occurred(void);
FROM_PYTHON int PyObject_GetBuffer(PyObject *, Py_buffer *, int);
FROM_PYTHON void PyBuffer_Release(Py_buffer *);
FROM_PYTHON double PyFloat_AsDouble(PyObject *);
FROM_PYTHON PyObject *PyNumber_Index(PyObject *);
FROM_PYTHON long long PyLong_AsLongLong(PyObject *);
FROM_PYTHON PyObject *PyFloat_FromDouble(double);
FROM_PYTHON PyObject *PyLong_FromLongLong(long long);
FROM_PYTHON PyObject *PyBool_FromLong(long);
FROM_PYTHON PyObject *PyTuple_New(Py_ssize_t);
FROM_PYTHON int PyTuple_SetItem(PyObject *, Py_ssize_t, PyObject *);
FROM_PYTHON PyObject *Py_BuildValue(const char *, ...);
FROM_PYTHON PyObject *PyCapsule_New(void *, const char *, void *);
FROM_PYTHON void *PyCapsule_GetPointer(PyObject *, const char *);
FROM_PYTHON PyObject *PyCFunction_NewEx(PyMethodDef *, PyObject *, PyObject *);
FROM_PYTHON PyObject *PyModule_Create2(PyModuleDef *, int);
FROM_PYTHON int PyModule_AddObjectRef(PyObject *, const char *, PyObject *);
FROM_PYTHON void Py_DecRef(PyObject *);
FROM_PYTHON void *PyEval_SaveThread(void);
FROM_PYTHON void PyEval_RestoreThread(void *);

enum { STABLE_ABI = 3, VECTOR_CALL = 0x0080, WRITABLE = 0x0001, FORMAT = 0x0004, STRIDES = 0x0018, MOST_ARGUMENTS = 24, MOST_RESULTS = 8 };

typedef struct {
    const char *name, *takes, *gives;
    void (*run)(const Arg *, Value *);
} Loop;

/* Whether an element of a buffer is what a letter asks for. */
static int is_kind(const Py_buffer *view, char kind) {
    const char *f = view->format ? view->format : "B";
    if (*f == '@' || *f == '=') f++;
    if (f[0] == 0 || f[1] != 0) return 0;
    switch (kind) {
        case 'F': return *f == 'd';
        case 'I': return view->itemsize == 8 && (*f == 'l' || *f == 'q');
        case 'O': return view->itemsize == 4 && (*f == 'i' || *f == 'l');
        case 'S': return *f == 'f';
        case 'B': return *f == '?' || *f == 'B';
        default: return *f == 'B' || *f == 'H' || *f == '?';
    }
}

/* Take one array; 0 where it is not what the loop takes, with Python's error set. */
static int take(PyObject *object, char letter, Arg *arg, Py_buffer *view, const Loop *loop, Py_ssize_t number) {
    int written = letter == 'f' || letter == 'j' || letter == 'b' || letter == 's' || letter == 'P';
    char kind = letter == 'f' ? 'F' : letter == 'j' ? 'I' : letter == 'b' ? 'B' : letter == 's' ? 'S' : letter == 'P' ? 'p' : letter;
    if (PyObject_GetBuffer(object, view, STRIDES | FORMAT | (written ? WRITABLE : 0))) return 0;
    Py_ssize_t packed = view->itemsize;
    int is_packed = 1;
    arg->n = 1;
    for (int axis = view->ndim - 1; axis >= 0; axis--) {
        if (view->shape[axis] > 1 && view->strides[axis] != packed) is_packed = 0;
        packed *= view->shape[axis];
        arg->n *= view->shape[axis];
    }
    if (!is_kind(view, kind) || view->ndim > 3 || (kind == 'p' ? view->ndim != 2 : !(is_packed || arg->n == 0))) {
        PyErr_Format(PyExc_TypeError, "%s: argument %d is not what the loop takes ('%c'): it has %d axes of format %s%s",
                     loop->name, (int)number + 1, letter, view->ndim, view->format, is_packed ? "" : ", not contiguous");
        PyBuffer_Release(view);
        return 0;
    }
    arg->data = view->buf;
    arg->bytes = (int)view->itemsize;
    for (int axis = 0; axis < 3; axis++) arg->shape[axis] = axis < view->ndim ? view->shape[axis] : 1;
    for (int axis = 0; axis < 2; axis++) arg->stride[axis] = axis < view->ndim ? view->strides[axis] : 0;
    return 1;
}

static PyObject *number(char letter, Value value) {
    if (letter == 'd') return PyFloat_FromDouble(value.d);
    return letter == 'i' ? PyLong_FromLongLong(value.i) : PyBool_FromLong(value.i != 0);
}

static PyObject *call(PyObject *self, PyObject *const *objects, Py_ssize_t count) {
    const Loop *loop = (const Loop *)PyCapsule_GetPointer(self, NULL);
    Arg args[MOST_ARGUMENTS];
    Py_buffer views[MOST_ARGUMENTS];
    char taken[MOST_ARGUMENTS];
    Value results[MOST_RESULTS];
    Py_ssize_t k = 0, wanted = (Py_ssize_t)strlen(loop->takes), given = (Py_ssize_t)strlen(loop->gives);
    PyObject *answer = NULL;
    if (count != wanted) return PyErr_Format(PyExc_TypeError, "%s takes %d arguments, but got %d", loop->name, (int)wanted, (int)count);
    for (; k < count; k++) {
        char letter = loop->takes[k];
        taken[k] = 0;
        if (letter == 'd') {
            args[k].d = PyFloat_AsDouble(objects[k]);
            if (args[k].d == -1.0 && PyErr_Occurred()) goto done;
        } else if (letter == 'i') {
            PyObject *whole = PyNumber_Index(objects[k]);
            if (!whole) goto done;
            args[k].i = PyLong_AsLongLong(whole);
            Py_DecRef(whole);
            if (args[k].i == -1 && PyErr_Occurred()) goto done;
        } else if (take(objects[k], letter, &args[k], &views[k], loop, k)) {
            taken[k] = 1;
        } else {
            goto done;
        }
    }
    void *thread = PyEval_SaveThread();
    loop->run(args, results);
    PyEval_RestoreThread(thread);
    if (given == 0) {
        answer = Py_BuildValue("");
    } else if (given == 1) {
        answer = number(loop->gives[0], results[0]);
    } else if ((answer = PyTuple_New(given)) != NULL) {
        for (Py_ssize_t j = 0; j < given; j++) PyTuple_SetItem(answer, j, number(loop->gives[j], results[j]));
    }
done:
    for (Py_ssize_t j = 0; j < k; j++)
        if (taken[j]) PyBuffer_Release(&views[j]);
    return answer;
}

static Loop LOOPS[] = {
#define ENTRY(name, takes, gives) {#name, takes, gives, name},
    ALL_LOOPS
#undef ENTRY
};
enum { COUNT = sizeof LOOPS / sizeof LOOPS[0] };
static PyMethodDef METHODS[COUNT];
static PyModuleDef MODULE = {1, NULL, NULL, 0, NULL, "_loops", "Loops in C.", -1, NULL, NULL, NULL, NULL, NULL};

TO_PYTHON PyObject *PyInit__loops(void) {
    PyObject *module = PyModule_Create2(&MODULE, STABLE_ABI);
    if (!module) return NULL;
    PREPARE_ALL
    for (int k = 0; k < COUNT; k++) {
        METHODS[k].name = LOOPS[k].name;
        METHODS[k].function = call;
        METHODS[k].flags = VECTOR_CALL;
        PyObject *self = PyCapsule_New(&LOOPS[k], NULL, NULL);
        PyObject *function = self ? PyCFunction_NewEx(&METHODS[k], self, NULL) : NULL;
        if (!function || PyModule_AddObjectRef(module, LOOPS[k].name, function)) return NULL;
        Py_DecRef(self);
        Py_DecRef(function);
    }
    return module;
}
