/* Quantiser step of every block of a picture. Arguments: FFmpeg's AVVideoEncParams, which contains entries for blocks (x,
   y, width, height, difference of the parameter); position of the first entry; bytes per entry; number of entries;
   parameter of the picture; step for every parameter; result, steps (rows, columns). Areas without an entry have the
   largest step. */
LOOP(quantiser_steps_fill, "BiiiiSs", "") {
    const float *table = (const float *)in[5].data;
    float *step = (float *)in[6].data, largest = 0.0f;
    int64_t rows = in[6].shape[0], columns = in[6].shape[1];
    for (int pass = 0; pass < 2; pass++) {
        for (int64_t k = 0; k < in[3].i; k++) {
            int32_t block[5];
            memcpy(block, FLAGS(0) + in[1].i + k * in[2].i, sizeof block);
            int64_t parameter = smaller_int(larger_int(in[4].i + block[4], LEAST_PARAMETER), MOST_PARAMETER);
            float own = table[parameter - LEAST_PARAMETER];
            if (pass == 0) largest = own > largest ? own : largest;
            else if (block[0] >= 0 && block[1] >= 0 && block[0] / BLOCK_PX < columns && block[1] / BLOCK_PX < rows)
                step[block[1] / BLOCK_PX * columns + block[0] / BLOCK_PX] = own;
        }
        for (int64_t i = 0; i < rows * columns && pass == 0; i++) step[i] = largest;
    }
}
