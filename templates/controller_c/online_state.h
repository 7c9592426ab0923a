/* @generated from src/control by `cargo run -p romc-translate`: state of the controller's own steps. Names that are defined
 * elsewhere: real, the type of numbers; NX and NU, how many states and inputs there are. */

typedef struct {
    /* gamma. */
    real estimate;
    /* Weights of the steps so far, and weights times what the steps say. */
    real weight;
    real weighted;
    /* phi^T phi of the first step, zero before. */
    real unit;
} online_share;

