/* The few functions of HAL that a module of kinematics calls, so that a test can ask the module itself: pins are plain
 * memory, which stand_in_set writes. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PINS_MAX 400

struct pin {
  char name[64];
  char kind;
  void* value;
};

static struct pin pins[PINS_MAX];
static int pin_count;

static int add_pin(void** where, char kind, const char* name) {
  if (pin_count >= PINS_MAX) return -1;
  struct pin* pin = &pins[pin_count++];
  snprintf(pin->name, sizeof pin->name, "%s", name);
  pin->kind = kind;
  *where = pin->value = calloc(1, 16);
  return 0;
}

int hal_init(const char* name) { return name ? 1 : -1; }
int hal_exit(int component) { return component < 0; }
int hal_ready(int component) { return component < 0; }
void* hal_malloc(long bytes) { return calloc(1, (size_t)bytes); }
void rtapi_print(const char* format, ...) { (void)format; }
void rtapi_print_msg(int level, const char* format, ...) { (void)level, (void)format; }

int hal_pin_bit_new(const char* name, int dir, void** where, int component) {
  (void)dir, (void)component;
  return add_pin(where, 'b', name);
}
int hal_pin_s32_new(const char* name, int dir, void** where, int component) {
  (void)dir, (void)component;
  return add_pin(where, 's', name);
}

#define NEW_PIN(function, kind)                                                      \
  int function(int dir, void** where, int component, const char* format, ...) {     \
    char name[64];                                                                   \
    va_list words;                                                                   \
    (void)dir, (void)component;                                                      \
    va_start(words, format);                                                         \
    vsnprintf(name, sizeof name, format, words);                                     \
    va_end(words);                                                                   \
    return add_pin(where, kind, name);                                               \
  }
NEW_PIN(hal_pin_float_newf, 'f')
NEW_PIN(hal_pin_bit_newf, 'b')
NEW_PIN(hal_pin_s32_newf, 's')
NEW_PIN(hal_pin_u32_newf, 's')

int stand_in_set(const char* name, double value) {
  for (int i = pin_count - 1; i >= 0; i--) {  // the newest of a module that was loaded twice
    if (strcmp(pins[i].name, name) != 0) continue;
    if (pins[i].kind == 'f') *(double*)pins[i].value = value;
    if (pins[i].kind == 'b') *(char*)pins[i].value = value != 0;
    if (pins[i].kind == 's') *(int*)pins[i].value = (int)value;
    return 0;
  }
  return -1;
}
